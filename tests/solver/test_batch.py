"""A batch of problems is solved as each of them is alone."""

from typing import Any

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.solver.batch import BatchSolution, integrate_batch
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.solution import Solution, Status
from odeform.types import Floats

UNTIL = 4.0
RATES = np.geomspace(0.2, 30.0, 7)
"""Of one oscillator each: some need many more steps than others."""


@pytest.fixture
def few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("batch", "integrate"):
        monkeypatch.setattr(f"odeform.solver.{module}.MAX_STEPS", 400)


class Oscillators:
    """z'' = -r^2 sin z - 0.1 z' + cos t, of a rate r each; in single precision where states are."""

    def __init__(self, rates: Floats) -> None:
        self.rates, self.asked = rates, 0

    def __call__(self, rows: Any, times: Any, states: Any) -> Any:
        self.asked += len(rows)
        position, speed = states.T.astype(float)
        pull = -(self.rates[rows] ** 2) * np.sin(position) - 0.1 * speed + np.cos(times)
        return np.stack([speed, pull], axis=1).astype(states.dtype)

    def alone(self, row: int) -> Any:
        return lambda time, state: self(np.array([row]), np.array([time]), state[None])[0]


def starts(dtype: str) -> Floats:
    return np.random.default_rng(0).normal(size=(len(RATES), 2)).astype(dtype)


SETTINGS = [
    SolverSettings("euler", step=0.01),
    SolverSettings("rk4", step=0.03, dtype="float64"),
    SolverSettings("bosh3", tolerance=1e-3),
    SolverSettings("bosh3", tolerance=1e-5, dtype="float64"),
    SolverSettings("dopri5", tolerance=1e-4),
    SolverSettings("dopri5", tolerance=1e-8, dtype="float64"),
]


@pytest.mark.parametrize("begin", [0.0, 0.7])
@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_every_problem_takes_the_steps_that_it_takes_alone(settings: SolverSettings, begin: float) -> None:
    field, start = Oscillators(RATES), starts(settings.dtype)
    batch = integrate_batch(field, start, settings, UNTIL, begin=begin)
    times = np.linspace(begin - 0.1, UNTIL + 0.5, 57)
    between = batch.sample(times)
    for row in range(len(RATES)):
        one = integrate(field.alone(row), start[row], settings, UNTIL, begin=begin)
        assert_same(batch, row, one)
        assert between.dtype == one.states[0].dtype
        np.testing.assert_allclose(between[row], one.sample(times), rtol=0.0, atol=1e-6)
    if settings.tolerance is not None:
        assert np.ptp(batch.steps) > 20  # or else steps were shared


def assert_same(batch: BatchSolution, row: int, one: Solution) -> None:
    nodes = batch.counts[row]
    assert nodes == len(one.times)
    assert batch.evaluations[row] == one.evaluations
    assert batch.rejected[row] == one.rejected
    assert batch.statuses[row] is one.status
    np.testing.assert_array_equal(batch.times[row, :nodes], one.times)
    np.testing.assert_array_equal(batch.states[row, :nodes], np.stack(one.states))
    assert np.isinf(batch.times[row, nodes:]).all()


def test_a_solution_does_not_depend_on_what_else_is_in_the_batch_nor_on_its_order() -> None:
    start, settings = starts("float32"), SolverSettings("bosh3", tolerance=1e-4)
    whole = integrate_batch(Oscillators(RATES), start, settings, UNTIL)
    order = np.array([5, 0, 3])
    part = integrate_batch(Oscillators(RATES[order]), start[order], settings, UNTIL)
    times = np.linspace(0.0, UNTIL, 33)
    np.testing.assert_array_equal(part.sample(times), whole.sample(times)[order])


def test_steps_do_not_depend_on_the_end() -> None:
    start, settings = starts("float64"), SolverSettings("dopri5", tolerance=1e-6, dtype="float64")
    short, long = (integrate_batch(Oscillators(RATES), start, settings, until) for until in (1.0, UNTIL))
    for row, count in enumerate(short.counts):
        np.testing.assert_array_equal(short.times[row, :count], long.times[row, :count])
        np.testing.assert_array_equal(short.states[row, :count], long.states[row, :count])


def test_a_problem_that_is_at_its_end_is_asked_no_more() -> None:
    field = Oscillators(RATES)
    batch = integrate_batch(field, starts("float64"), SETTINGS[3], UNTIL)
    assert field.asked == batch.evaluations.sum()


class Failing:
    """Grows beyond all bounds, is not a number from 1 s on, is not from the start, or is well."""

    def __call__(self, rows: Any, times: Any, states: Any) -> Any:
        values = states[:, 0]
        late, never = np.where(times > 1.0, np.nan, 1.0), np.full_like(values, np.nan)
        slopes = np.stack([values**2, late, never, -values])
        return slopes[rows, np.arange(len(rows))][:, None].astype(states.dtype)


@pytest.mark.parametrize("settings", [SETTINGS[0], SETTINGS[2], SETTINGS[5]], ids=str)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_failure_ends_one_problem_with_its_status(settings: SolverSettings, few_steps: None) -> None:
    field, start = Failing(), np.full((4, 1), 2.0, settings.dtype)
    batch = integrate_batch(field, start, settings, UNTIL)
    for row in range(4):

        def alone(time: float, state: Floats, row: int = row) -> Floats:
            return field(np.array([row]), np.array([time]), state[None])[0]

        assert_same(batch, row, integrate(alone, start[row], settings, UNTIL))
    assert batch.statuses[2] is Status.NON_FINITE
    assert batch.statuses[3] is Status.OK
    assert not batch.ok[:3].any()


@pytest.mark.parametrize("settings", [SETTINGS[0], SETTINGS[2]], ids=str)
def test_too_many_steps_end_the_problem_that_takes_them(settings: SolverSettings, few_steps: None) -> None:
    field, start = Oscillators(RATES), starts("float32")
    batch = integrate_batch(field, start, settings, 3.0 * UNTIL)
    assert Status.MAX_STEPS in batch.statuses
    for row in range(len(RATES)):
        assert_same(batch, row, integrate(field.alone(row), start[row], settings, 3.0 * UNTIL))


class Rotors:
    """Stiff fields whose steps are exact turns; their errors are those of a method of second order."""

    def __call__(self, rows: Any, times: Any, states: Any) -> Any:
        return RATES[rows, None] * np.stack([-states[:, 1], states[:, 0]], axis=1)

    def advance(self, rows: Any, times: Any, states: Any, steps: Any) -> Any:
        angle = RATES[rows] * steps
        cosine, sine = np.cos(angle), np.sin(angle)
        after = np.stack(
            [cosine * states[:, 0] - sine * states[:, 1], sine * states[:, 0] + cosine * states[:, 1]], axis=1
        )
        return after, self(rows, times + steps, after), angle**2 * np.abs(states[:, 0])


class Rotor:
    def __init__(self, row: int) -> None:
        self.row = row

    def __call__(self, time: float, state: Any) -> Any:
        return Rotors()(np.array([self.row]), np.array([time]), state[None])[0]

    def advance(self, time: float, state: Any, step: float) -> Any:
        after, slope, error = Rotors().advance(np.array([self.row]), np.array([time]), state[None], np.array([step]))
        return after[0], slope[0], float(error[0])


def test_fields_with_steps_of_their_own() -> None:
    settings = SolverSettings("limex", tolerance=1e-3, dtype="float64")
    batch = integrate_batch(Rotors(), starts("float64"), settings, UNTIL)
    for row in range(len(RATES)):
        assert_same(batch, row, integrate(Rotor(row), starts("float64")[row], settings, UNTIL))


def test_what_cannot_be_solved_in_a_batch() -> None:
    with pytest.raises(InputError, match="limex: expected the field of a mechanical model"):
        integrate_batch(Oscillators(RATES), starts("float64"), SolverSettings("limex", step=0.1), 1.0)
    with pytest.raises(InputError, match="expected states in float32 or float64, got float16"):
        integrate_batch(Oscillators(RATES), starts("float16"), SETTINGS[0], 1.0)


def test_no_time_asks_for_no_steps() -> None:
    batch = integrate_batch(Oscillators(RATES), starts("float64"), SETTINGS[3], 0.0)
    assert not batch.steps.any()
    np.testing.assert_array_equal(batch.sample(np.array([0.0, 1.0]))[:, 1], starts("float64"))


def test_before_step_may_end_it() -> None:
    def stop() -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        integrate_batch(Oscillators(RATES), starts("float64"), SETTINGS[3], UNTIL, stop)
