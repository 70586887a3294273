"""A solved motion whose controlled steps fail: fixed ones take over, and say so."""

from collections.abc import Callable

import numpy as np
import pytest

from odeform.models.solved import Problem, SolvedTrajectory
from odeform.solver import integrate as solver
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.registry import TITLES
from odeform.solver.solution import Status
from odeform.types import Floats

FIXED = SolverSettings("rk4", step=0.01, dtype="float64")
Field = Callable[[float, Floats], Floats]


def stiff(time: float, state: Floats) -> Floats:
    """Bounded, as fields of tanh layers are, and so steep that no explicit method of controlled steps gets far."""
    return -10.0 * np.tanh(1e7 * (state - np.cos(time)))


def pole(_: float, state: Floats) -> Floats:
    """From 1 it is at infinity after one second."""
    return state**2


def decode(times: Floats, states: Floats) -> Floats:
    return np.concatenate([np.zeros((len(times), 6)), states - 1.0], axis=1)


@pytest.fixture(autouse=True)
def _few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solver, "MAX_STEPS", 400)


def solve(field: Field, quality: SolverSettings, until: float) -> SolvedTrajectory:
    problem = Problem(field, np.array([1.0]), decode)
    return SolvedTrajectory(problem, quality, FIXED, until, 0.1, lambda: problem)


@pytest.mark.parametrize("method", ["bosh3", "dopri5"])
def test_fixed_steps_take_over(method: str) -> None:
    quality = SolverSettings(method, tolerance=1e-6, dtype="float64")
    alone = integrate(stiff, np.array([1.0]), quality, 0.1)
    assert alone.status is Status.MAX_STEPS
    times = np.concatenate([np.linspace(0.0, alone.end, 9), np.linspace(alone.end, 0.1, 21)[1:]])
    motion = solve(stiff, quality, 0.1)
    stats = motion.stats
    assert stats.status == "fixed steps"
    assert stats.solver.startswith("Runge-Kutta 4, steps of 10 ms")
    assert f"{TITLES[method]}, tolerance 1e-06 failed at t = {alone.end:.3f} s: step limit reached" in stats.solver
    assert stats.evaluations > alone.evaluations
    assert stats.solver_error_mm is None
    assert motion.last_good == np.inf
    y = motion.reduced(times)[:, 6] + 1.0
    assert np.array_equal(y[:9], alone.sample(times[:9])[:, 0])
    # fixed steps overshoot by at most what the slope of 10 does in one
    assert 1e-6 < np.abs(y - np.cos(times)).max() < 0.1


def test_what_was_said_stands_when_steps_fail_later() -> None:
    quality, times = SolverSettings("bosh3", tolerance=1e-6, dtype="float64"), np.linspace(0.0, 0.1, 21)
    late, early = solve(stiff, quality, 0.1), solve(stiff, quality, 1e-5)
    assert early.stats.status == "ok"
    early.reduced(np.array([0.03]))
    assert early.stats.status == "fixed steps"
    assert np.array_equal(early.reduced(times), late.reduced(times))


def test_where_fixed_steps_fail_too_the_last_good_state_stays() -> None:
    motion = solve(pole, SolverSettings("dopri5", tolerance=1e-6, dtype="float64"), 5.0)
    assert motion.stats.status == "fixed steps, non-finite state"
    assert 1.0 <= motion.last_good < 2.0
    last, later = motion.reduced(np.array([motion.last_good])), motion.reduced(np.array([5.0]))
    assert np.isfinite(last).all()
    assert np.array_equal(last, later)


def test_fixed_steps_that_fail_have_nothing_to_fall_back_on() -> None:
    motion = solve(pole, FIXED, 5.0)
    assert motion.stats.status == "non-finite state"
    assert motion.stats.solver == "Runge-Kutta 4, steps of 10 ms"


@pytest.mark.parametrize(
    "quality",
    [
        SolverSettings("euler", step=0.05, dtype="float64"),
        SolverSettings("rk4", step=0.2, dtype="float64"),
        SolverSettings("rk4", step=0.05, dtype="float64"),
        SolverSettings("bosh3", tolerance=1e-2, dtype="float64"),
        SolverSettings("dopri5", tolerance=1e-6, dtype="float64"),
    ],
)
def test_the_reported_error_is_the_true_one(quality: SolverSettings) -> None:
    """dz/dt = -z from 1: at any setting, RMS over time and the three axes, within a tenth."""
    motion = solve(lambda _, state: -state, quality, 2.0)
    times = np.linspace(0.0, 2.0, 129)[1:]
    off = motion.reduced(times)[:, 6] + 1.0 - np.exp(-times)
    assert motion.stats.solver_error_mm == pytest.approx(1e3 * np.sqrt((off**2).mean() / 3.0), rel=0.1)
