"""How the length of the next step follows from the errors of the last ones (Gustafsson 1991; Hairer, Norsett and
Wanner 1993, II.4), by a method whose errors are made up."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.method import Field
from odeform.solver.registry import METHODS
from odeform.solver.solution import Solution, Status

TOLERANCE = 1e-3


class Scripted:
    """Steps of Euler's method, with errors of given ratios to the tolerance."""

    evaluations = 1

    def __init__(self, ratios: Iterator[float]) -> None:
        self.ratios = ratios

    def step(self, field: Field, time: float, state: Any, slope: Any, step: float) -> tuple[Any, Any]:
        return state + step * slope, field(time + step, state + step * slope)

    def error(self, step: float) -> Any:
        return TOLERANCE * next(self.ratios) * np.array([1.0, -1.0])  # whose root mean square is that

    def middle(self, state: Any, step: float) -> Any:
        raise NotImplementedError


class Method:
    name, order, controls_step, knows_middle = "scripted", 2, True, False

    def __init__(self, ratios: tuple[float, ...]) -> None:
        self.accepted, self.ratios = sum(ratio <= 1.0 for ratio in ratios), iter(ratios)

    def stepper(self, start: Any) -> Scripted:
        return Scripted(self.ratios)


class MethodWithGains(Method):
    gains = 0.8, 0.2


def flat(_: float, state: np.ndarray) -> np.ndarray:
    return np.zeros_like(state)


def solved(monkeypatch: pytest.MonkeyPatch, method: Method, first: float = 1.0) -> Solution:
    """As far as the errors are given, from a step of `first` seconds on."""
    monkeypatch.setitem(METHODS, "scripted", method)
    begun = Solution([0.0], [np.ones(2)], [np.zeros(2)], next_step=first)
    settings, solution = SolverSettings("scripted", tolerance=TOLERANCE, dtype="float64"), begun
    while solution.steps < method.accepted:
        solution = integrate(flat, begun.states[0], settings, math.nextafter(solution.end, math.inf), begin=begun)
    return solution


def next_steps(*lengths: float) -> Any:
    return pytest.approx(list(lengths), rel=1e-9)


def test_a_step_follows_from_its_error_and_the_one_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of second order: exponents 0.35 and 0.2, a ninth part less."""
    solution = solved(monkeypatch, Method((0.5, 0.2, 0.8)))
    one = 0.9 * 0.5**-0.35
    two = one * 0.9 * 0.2**-0.35 * 0.5**0.2
    three = two * 0.9 * 0.8**-0.35 * 0.2**0.2
    assert np.diff(solution.times).tolist() == next_steps(1.0, one, two)
    assert solution.next_step == pytest.approx(three)
    assert solution.last_ratio == pytest.approx(0.8)
    assert solution.rejected == 0


def test_a_method_may_have_its_own_exponents(monkeypatch: pytest.MonkeyPatch) -> None:
    solution = solved(monkeypatch, MethodWithGains((0.5, 0.2)))
    one = 0.9 * 0.5**-0.4
    assert np.diff(solution.times).tolist() == next_steps(1.0, one)
    assert solution.next_step == pytest.approx(one * 0.9 * 0.2**-0.4 * 0.5**0.1)


def test_a_rejected_step_is_repeated_shorter_and_the_next_does_not_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    solution = solved(monkeypatch, Method((1.5, 0.1, 0.1)))
    again = 0.9 * 1.5**-0.5
    # after the repetition 0.9 * 0.1**-0.35 = 2 would be allowed, but the step stays; the next grows again
    assert np.diff(solution.times).tolist() == next_steps(again, again)
    assert solution.next_step == pytest.approx(again * 0.9 * 0.1**-0.35 * 0.1**0.2)
    assert solution.rejected == 1


def test_an_error_as_large_as_the_tolerance_is_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    solution = solved(monkeypatch, Method((1.0,)))
    assert (solution.steps, solution.rejected) == (1, 0)
    assert solution.next_step == pytest.approx(0.9)


def test_steps_change_by_a_factor_of_five_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = solved(monkeypatch, Method((0.0,)))
    assert exact.next_step == pytest.approx(5.0)
    assert exact.last_ratio == 1e-4  # bounded, or else the step after would be tiny
    far = solved(monkeypatch, Method((1e4, 0.9)))
    assert far.times[1] == pytest.approx(0.2)
    # accepted, but after a step that was very exact: 0.9 * 0.9**-0.35 * 1e-4**0.2 is less than a fifth
    worse = solved(monkeypatch, Method((0.0, 0.9)))
    assert worse.next_step == pytest.approx(5.0 * 0.2)


def test_a_step_that_overflows_is_repeated_a_fifth_as_long(monkeypatch: pytest.MonkeyPatch) -> None:
    for lost in (math.inf, math.nan):
        solution = solved(monkeypatch, Method((lost, 0.9)))
        assert solution.times[1] == pytest.approx(0.2)
        assert solution.rejected == 1


def test_steps_that_vanish_end_the_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(METHODS, "scripted", Method((math.inf,) * 40))
    begun = Solution([1.0], [np.ones(2)], [np.zeros(2)], next_step=1e-3)
    found = integrate(flat, np.ones(2), SolverSettings("scripted", tolerance=TOLERANCE), 2.0, begin=begun)
    assert found.status is Status.UNDERFLOW
    # 1e-3 / 5**19 is the first below half a unit in the last place of 1
    assert found.rejected == math.ceil(math.log(1e-3 * 2.0**53, 5.0))
    assert found.steps == 0


def test_rejections_count_as_steps_for_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(METHODS, "scripted", Method((1.0 + 1e-9, 0.2455, 0.2455) * 10_000))
    begun = Solution([0.0], [np.ones(2)], [np.zeros(2)], next_step=1.0)
    found = integrate(flat, np.ones(2), SolverSettings("scripted", tolerance=TOLERANCE), 1e300, begin=begun)
    assert found.status is Status.MAX_STEPS
    assert found.steps + found.rejected == 20_000


@pytest.mark.parametrize(("speed", "bend"), [(3.0, 2.0), (0.5, 40.0)])
def test_the_first_step_is_that_of_hairer_norsett_and_wanner(speed: float, bend: float) -> None:
    """dz/dt = speed + bend t, z(0) = 2: an Euler step of h0 = 0.01 |z| / |z'| shows the second derivative."""
    tolerance, start = 1e-3, np.full(3, 2.0)
    solution = integrate(
        lambda t, z: np.full(3, speed + bend * t), start, SolverSettings("bosh3", tolerance=tolerance), until=1e-9
    )
    small = 0.01 * 2.0 / speed
    steep = max(speed, bend) / tolerance
    expected = min(100.0 * small, (0.01 / steep) ** (1.0 / 3.0))
    assert solution.times[1] == pytest.approx(expected)
    assert solution.evaluations == 2 + 3


def test_the_first_step_from_rest_is_short() -> None:
    """Nothing is known of the scale: 1e-6 s, or up to a hundred times as long."""
    settings = SolverSettings("bosh3", tolerance=1e-3)
    still = integrate(lambda t, z: np.zeros(1), np.zeros(1), settings, until=1e-9)
    assert still.times[1] == pytest.approx(1e-6)
    pushed = integrate(lambda t, z: np.full(1, 1e3 * t), np.zeros(1), settings, until=1e-9)
    assert pushed.times[1] == pytest.approx(1e-4)


def test_control_by_two_errors_rejects_fewer_steps_on_a_rough_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """Into a steep front, whose errors grow from step to step."""

    def rough(time: float, state: np.ndarray) -> np.ndarray:
        return np.array([state[1], 25.0 * (1.0 - state[0] ** 2) * state[1] - state[0]])

    monkeypatch.setitem(METHODS, "proportional", Proportional())
    start, rejected = np.array([2.0, 0.0]), []
    for name in ("bosh3", "proportional"):
        found = integrate(rough, start, SolverSettings(name, tolerance=1e-5, dtype="float64"), until=60.0)
        assert found.status is Status.OK
        rejected.append(found.rejected / found.steps)
    assert rejected[0] < 0.5 * rejected[1]


class Proportional(type(METHODS["bosh3"])):
    """Bogacki and Shampine's method, whose steps follow from the last error alone."""

    gains = 1.0, 0.0

    def __init__(self) -> None:
        super().__init__(METHODS["bosh3"].tableau)  # pyright: ignore[reportAttributeAccessIssue]
