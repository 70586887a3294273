"""Single steps of fourth order."""

import math

import numpy as np
import pytest

from odeform.solver.kutta import classic, three_eighths


def field(state: float, time: float) -> float:
    return (1.0 + state**2) * math.cos(time)  # of which tan(sin t) is a solution


@pytest.mark.parametrize("rule", ["classic", "three_eighths"])
def test_they_are_of_fourth_order(rule: str) -> None:
    counts, errors = (10, 20, 40), []
    for count in counts:
        state, length = math.tan(math.sin(0.3)), 0.8 / count
        for index in range(count):
            begin, end = 0.3 + length * index, 0.3 + length * (index + 1)
            if rule == "classic":
                state = classic(field, state, length, begin, 0.5 * (begin + end), end)
            else:
                state = three_eighths(field, state, begin, end)
        errors.append(abs(state - math.tan(math.sin(1.1))))
    slope = np.polyfit(np.log(1.0 / np.array(counts)), np.log(errors), 1)[0]
    assert slope == pytest.approx(4.0, abs=0.2)
    assert errors[-1] < 1e-6


def test_they_are_different_rules() -> None:
    """A cubic of the time is integrated exactly by both; of z' = z they give the exponential series to fourth order."""
    cubic = lambda _, t: 4.0 * t**3  # noqa: E731
    assert classic(cubic, 0.0, 2.0, 0.0, 1.0, 2.0) == pytest.approx(16.0)
    assert three_eighths(cubic, 0.0, 0.0, 2.0) == pytest.approx(16.0)
    series = 1.0 + 0.5 + 0.5**2 / 2 + 0.5**3 / 6 + 0.5**4 / 24
    assert classic(lambda z, _: z, 1.0, 0.5, 0.0, 0.25, 0.5) == pytest.approx(series)
    assert three_eighths(lambda z, _: z, 1.0, 0.0, 0.5) == pytest.approx(series)
    asked: list[float] = []

    def noted(_: float, time: float) -> float:
        asked.append(time)
        return 0.0

    classic(noted, 0.0, 3.0, 0.0, 1.5, 3.0)
    three_eighths(noted, 0.0, 0.0, 3.0)
    assert asked == [0.0, 1.5, 1.5, 3.0, 0.0, 1.0, 2.0, 3.0]
