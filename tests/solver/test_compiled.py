"""Compiled loops take the steps that NumPy takes, of one problem or of many."""

import subprocess
import sys
from collections.abc import Callable
from typing import Any, no_type_check

import numpy as np
import pytest

from odeform.compiling import compiles
from odeform.solver.batch import integrate_batch
from odeform.solver.batch_steps import Together
from odeform.solver.compiled import CompiledField
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.solution import Solution, Status

pytestmark = pytest.mark.skipif(not compiles(), reason="nothing is compiled")
UNTIL = 9.0
SETTINGS = [
    SolverSettings("euler", step=0.01, dtype="float64"),
    SolverSettings("rk4", step=0.03, dtype="float64"),
    SolverSettings("bosh3", tolerance=1e-5, dtype="float64"),
    SolverSettings("dopri5", tolerance=1e-5, dtype="float64"),
]
NONE = np.zeros(0, dtype=int)


@no_type_check
def _swinging(state, own, shared, sizes, out):
    """A pendulum of the rate own[0], damped, that is lost below shared[0]."""
    out[0] = state[1]
    out[1] = -own[0] * np.sin(state[0]) - shared[1] * state[1]
    if state[0] < shared[0]:
        out[1] = np.nan


def pendulum(rate: float, lowest: float = -9.0, dtype: type = np.float64) -> CompiledField:
    return CompiledField(_swinging, np.array([rate], dtype), np.array([lowest, 0.1], dtype), NONE)


def in_numpy(field: CompiledField) -> Callable[[float, Any], Any]:
    def slope(time: float, state: Any) -> Any:
        out = np.empty_like(state)
        _swinging(state, field.own, field.given[1], NONE, out)
        return out

    return slope


LOST = pendulum(4.0, 0.0)
START = np.array([2.0, 0.3])


def assert_alike(one: Solution, other: Solution) -> None:
    assert (one.steps, one.evaluations, one.rejected, one.status) == (
        other.steps, other.evaluations, other.rejected, other.status
    )  # fmt: skip
    np.testing.assert_allclose(one.times, other.times, rtol=1e-9)
    for name in ("states", "slopes", "middles"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_steps_are_those_of_numpy(settings: SolverSettings) -> None:
    field, times = pendulum(4.0), np.linspace(0.5, 10.0, 77)
    found, expected = (integrate(each, START, settings, UNTIL, begin=0.7) for each in (field, in_numpy(field)))
    assert_alike(found, expected)
    assert found.status is Status.OK
    np.testing.assert_allclose(found.sample(times), expected.sample(times), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_a_field_that_is_lost_ends_it_as_in_numpy(settings: SolverSettings) -> None:
    found, expected = (integrate(each, START, settings, UNTIL) for each in (LOST, in_numpy(LOST)))
    assert found.status is expected.status is not Status.OK
    assert found.end == pytest.approx(expected.end, abs=1e-6)


@pytest.mark.parametrize("settings", SETTINGS[1:3], ids=str)
def test_too_many_steps_end_it(settings: SolverSettings, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("odeform.solver.integrate.MAX_STEPS", 40)
    found = integrate(pendulum(4.0), START, settings, UNTIL)
    assert found.status is Status.MAX_STEPS
    assert found.steps + found.rejected == 40


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_a_solution_that_is_continued_is_the_same(settings: SolverSettings) -> None:
    field = pendulum(4.0)
    whole, parts = integrate(field, START, settings, UNTIL), integrate(field, START, settings, 0.01)
    for until in (0.02, 1.0, 5.0, UNTIL):
        integrate(field, START, settings, until, begin=parts)
    assert_alike(parts, whole)
    assert parts.times == whole.times
    assert np.array_equal(parts.states, whole.states)


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_many_are_solved_to_the_bits_of_each(settings: SolverSettings) -> None:
    fields = [pendulum(rate) for rate in (0.5, 4.0, 90.0)]
    starts = np.stack([START, 0.1 * START, -START])
    batch = integrate_batch(Together(fields), starts, settings, UNTIL, begin=0.7)
    for row, (field, start) in enumerate(zip(fields, starts, strict=True)):
        one, count = integrate(field, start, settings, UNTIL, begin=0.7), batch.counts[row]
        assert (count, batch.rejected[row], batch.evaluations[row]) == (len(one.times), one.rejected, one.evaluations)
        assert batch.times[row, :count].tolist() == one.times
        assert np.isinf(batch.times[row, count:]).all()
        assert np.array_equal(batch.states[row, :count], one.states)
        times = np.linspace(0.7, UNTIL, 33)
        np.testing.assert_array_equal(batch.sample(times)[row], one.sample(times))


def test_a_failure_ends_one_problem_of_many() -> None:
    starts = np.stack([START, [np.nan, 0.0], 0.1 * START])
    batch = integrate_batch(Together([pendulum(4.0)] * 3), starts, SETTINGS[2], UNTIL)
    assert [status is Status.OK for status in batch.statuses] == [True, False, True]
    batch = integrate_batch(Together([LOST, LOST]), starts[[0, 2]], SETTINGS[2], UNTIL)
    for row, start in enumerate(starts[[0, 2]]):
        assert batch.statuses[row] is integrate(LOST, start, SETTINGS[2], UNTIL).status is not Status.OK


def test_single_precision_stays_single() -> None:
    settings = SolverSettings("bosh3", tolerance=1e-4)
    found = integrate(pendulum(4.0, dtype=np.float32), START.astype(np.float32), settings, UNTIL)
    assert {state.dtype for state in found.states} == {np.dtype(np.float32)}
    exact = integrate(pendulum(4.0), START, SETTINGS[2], UNTIL)
    times = np.linspace(0.0, UNTIL, 50)
    np.testing.assert_allclose(found.sample(times), exact.sample(times), rtol=0.0, atol=2e-2)


def test_importing_takes_no_compiler() -> None:
    code = "import sys, odeform; odeform.load('kick'); assert 'numba' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
