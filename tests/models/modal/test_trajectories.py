"""What is done to motions of the mechanics: weights, a regression of the rest, and a projection out of the floor."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from odeform.models.residual import Residual, weight_of
from odeform.motion.base import SolveStats
from odeform.motion.floor_projection import MOST, FloorProjection
from odeform.motion.trajectory import Adjusted
from odeform.types import Floats

STOP = 0.2  # s
SPEED = np.array([1.0, 2.0, -3.0, 0.1, 0.2, 0.3, 0.01, 0.02])
KEPT = weight_of({"shift": 0.5, "rotation": 1.0, "deformation": 0.8}, np.array([1.0, 2.5]))


STATS = SolveStats("none", 0, 0, 0, "ok", 0.0, lambda: None)


@dataclass
class Steady:
    """Every coordinate grows at its own speed."""

    last_good: float = 1.0
    stats: SolveStats = STATS

    def reduced(self, times: Floats) -> Floats:
        return times[:, None] * SPEED


class Constant:
    """Adds one to every coordinate."""

    def frames(self, inputs: None) -> Floats:
        return np.ones((5, len(SPEED)))


def corrected() -> Adjusted:
    own, residual = Steady(), Residual(np.linspace(0.0, STOP, 5), KEPT, Constant())
    return Adjusted(own, residual.adjustment(own, None))


def projected(lowest: Callable[[Floats], Floats], limit: float, grid: Floats | None) -> Adjusted:
    own = Steady()
    return Adjusted(own, FloorProjection(own, lowest, lambda times: np.full(len(times), limit), grid))


def test_a_part_has_its_weight_of_the_mechanics_and_each_coefficient_its_scale() -> None:
    np.testing.assert_array_equal(KEPT, [0.5, 0.5, 0.5, 1.0, 1.0, 1.0, 0.8, 2.0])
    times = np.array([0.05, 0.15])
    np.testing.assert_allclose(corrected().reduced(times), KEPT * times[:, None] * SPEED + 1.0)
    assert not corrected().reduced(np.zeros(1)).any()


def test_beyond_the_window_a_body_moves_as_the_mechanics_does() -> None:
    times = np.array([STOP, 0.5, 0.7])
    y = corrected().reduced(times)
    np.testing.assert_allclose(np.diff(y, axis=0), np.diff(times)[:, None] * SPEED)
    np.testing.assert_allclose(corrected().reduced(times[1:]), y[1:], atol=1e-15)
    np.testing.assert_allclose(y[0], corrected().reduced(times[:1] - 1e-9)[0], atol=1e-7)


@pytest.mark.parametrize("grid", [0.025, 0.0125])
def test_a_body_is_lifted_by_what_is_too_deep(grid: float) -> None:
    limit = -0.006
    knots = np.arange(0.0, STOP + 1e-9, grid)

    def lowest(y: Floats) -> Floats:
        return 0.05 * y[:, 2]  # a leg that sinks at 0.15 m/s

    lifted = projected(lowest, limit, knots)
    times = np.array([0.01, 0.1])
    below, deep = lowest(Steady().reduced(times)) - limit
    assert below > 0.0 > deep > -MOST
    y, own = lifted.reduced(times), Steady().reduced(times)
    np.testing.assert_array_equal(y[0], own[0])
    np.testing.assert_allclose(y[1] - own[1], [0.0, 0.0, -deep, 0.0, 0.0, 0.0, 0.0, 0.0], atol=1e-12)
    assert lifted.last_good == 1.0


def test_between_its_times_a_change_is_linear_whatever_is_asked_with_it() -> None:
    def lowest(y: Floats) -> Floats:
        return -0.04 * y[:, 2] ** 2

    limit, asked = -0.006, np.array([0.15])
    with_knots, without = projected(lowest, limit, np.array([0.0, 0.1, STOP])), projected(lowest, limit, None)
    own, lifted = Steady().reduced(asked)[0, 2], with_knots.reduced(asked)
    assert lifted[0, 2] - own == pytest.approx(0.5 * (0.36 * STOP**2 + limit))
    np.testing.assert_array_equal(with_knots.reduced(np.array([0.15, 0.3]))[:1], lifted)
    assert without.reduced(asked)[0, 2] - own == pytest.approx(0.36 * 0.15**2 + limit)


def test_what_is_lost_is_not_lifted() -> None:
    def nowhere(y: Floats) -> Floats:
        return np.where(np.arange(len(y)) % 2, -1.0, np.nan)

    lifted = projected(nowhere, 0.0, np.linspace(0.0, STOP, 9))
    times = np.linspace(0.0, STOP, 5)
    np.testing.assert_array_equal(lifted.reduced(times), Steady().reduced(times))
