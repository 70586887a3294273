import math

import numpy as np
import pytest
import torch
import torchdiffeq

from odeform.errors import InputError
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.registry import METHODS
from odeform.solver.solution import Solution, Status

EXPLICIT = [name for name in METHODS if name != "limex"]  # that one steps fields of its own kind
QUALITIES = [
    *(SolverSettings(name, step=0.05) for name in EXPLICIT),
    SolverSettings("bosh3", tolerance=1e-5),
    SolverSettings("dopri5", tolerance=1e-7),
]


def field(time: float, state: np.ndarray) -> np.ndarray:
    """Two nonlinear equations, one driven by time, with `exact` as their solution."""
    return np.array([(1.0 + state[0] ** 2) * math.cos(time), state[1] * (1.0 - state[1])])


def exact(time: float) -> np.ndarray:
    return np.array([math.tan(math.sin(time)), 1.0 / (1.0 + 3.0 * math.exp(-time))])


def oscillator(time: float, state: np.ndarray) -> np.ndarray:
    """Van der Pol: fast and slow stretches, so that controlled steps vary and are sometimes rejected."""
    return np.array([state[1], 5.0 * (1.0 - state[0] ** 2) * state[1] - state[0]])


def order(steps: list[float], errors: list[float]) -> float:
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def same(one: Solution, two: Solution, nodes: int) -> bool:
    return all(
        np.array_equal(a[:nodes], b[:nodes])
        for a, b in ((one.times, two.times), (one.states, two.states), (one.slopes, two.slopes))
    ) and np.array_equal(one.middles[: nodes - 1], two.middles[: nodes - 1])


@pytest.mark.parametrize("name", EXPLICIT)
def test_order_at_the_nodes(name: str) -> None:
    steps = [2.0**-k for k in (range(3, 7) if name == "dopri5" else range(4, 9))]
    errors = []
    for step in steps:
        solution = integrate(field, exact(0.0), SolverSettings(name, step=step), until=2.0)
        errors.append(max(np.abs(s - exact(t)).max() for t, s in zip(solution.times, solution.states, strict=True)))
    assert order(steps, errors) == pytest.approx(METHODS[name].order, abs=0.2)


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="no extended precision here")
@pytest.mark.parametrize("name", ["rk4", "bosh3", "dopri5"])
def test_extended_precision_is_kept(name: str) -> None:
    """Coefficients that are rounded to double would leave an error of some 1e-17 a step."""
    first, e = np.ones(1, dtype=np.longdouble), np.exp(np.longdouble(1.0))
    steps, errors = (100, 200), []
    for count in steps:
        solution = integrate(lambda _, z: z, first, SolverSettings(name, step=1.0 / count), until=1.0)
        assert solution.states[-1].dtype == np.longdouble
        errors.append(float(abs(solution.states[-1][0] - e)))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(METHODS[name].order, abs=0.1)
    assert errors[1] < {"rk4": 1e-10, "bosh3": 1e-7, "dopri5": 3e-14}[name]


@pytest.mark.parametrize("name", EXPLICIT)
def test_order_between_the_nodes(name: str) -> None:
    """The cubic between nodes is of fourth order: no method of up to that order loses by it."""
    steps = [2.0**-k for k in range(4, 9)]
    times = np.linspace(0.0, 2.0, 997)
    truth = np.stack([exact(t) for t in times])
    errors = [
        np.abs(integrate(field, exact(0.0), SolverSettings(name, step=step), until=2.0).sample(times) - truth).max()
        for step in steps
    ]
    assert order(steps, errors) == pytest.approx(min(METHODS[name].order, 4), abs=0.2)


def test_quartic_within_one_dopri5_step() -> None:
    """Local error h^5 inside a step: the state at its middle lifts the cubic's h^4 by one order."""
    steps, errors = [2.0**-k for k in range(2, 7)], []
    begin = 0.5
    for step in steps:
        start = exact(begin)
        first = Solution([begin], [start], [field(begin, start)], next_step=step)
        solution = integrate(field, start, SolverSettings("dopri5", tolerance=1.0), begin + 0.5 * step, begin=first)
        assert solution.steps == 1
        inside = begin + step * np.linspace(0.05, 0.95, 19)
        errors.append(np.abs(solution.sample(inside) - np.stack([exact(t) for t in inside])).max())
    assert order(steps, errors) == pytest.approx(5.0, abs=0.2)


@pytest.mark.parametrize("name", ["bosh3", "dopri5"])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7, 1e-9])
def test_controlled_steps_meet_their_tolerance(name: str, tolerance: float) -> None:
    solution = integrate(field, exact(0.0), SolverSettings(name, tolerance=tolerance), until=5.0)
    assert solution.status is Status.OK
    error = max(np.abs(s - exact(t)).max() for t, s in zip(solution.times, solution.states, strict=True))
    # the tolerance is for a step; several add up, and the interpolant is not controlled at all
    assert error < 10.0 * tolerance
    times = np.linspace(0.0, 5.0, 501)
    assert np.abs(solution.sample(times) - np.stack([exact(t) for t in times])).max() < 100.0 * tolerance


def test_agrees_with_torchdiffeq() -> None:
    times, calls = np.linspace(0.0, 10.0, 101), 0

    def torch_field(_: torch.Tensor, y: torch.Tensor) -> torch.Tensor:
        nonlocal calls
        calls += 1
        return torch.stack([y[1], 5.0 * (1.0 - y[0] ** 2) * y[1] - y[0]])

    start = np.array([2.0, 0.0])
    # their tolerance is relative to the state as well
    solution = integrate(oscillator, start, SolverSettings("dopri5", tolerance=1e-8), until=10.0)
    theirs = torchdiffeq.odeint(
        torch_field, torch.tensor(start), torch.tensor(times), rtol=1e-9, atol=1e-9, method="dopri5"
    )
    assert np.abs(solution.sample(times) - theirs.numpy()).max() < 1e-7
    assert solution.evaluations < 1.2 * calls


@pytest.mark.parametrize("quality", QUALITIES, ids=str)
def test_does_not_depend_on_where_it_ends(quality: SolverSettings) -> None:
    start = np.array([2.0, 0.0])
    short, long = (integrate(oscillator, start, quality, until=until) for until in (0.73, 3.0))
    assert short.end >= 0.73
    assert long.steps > short.steps
    assert same(short, long, short.steps + 1)


@pytest.mark.parametrize("quality", QUALITIES, ids=str)
def test_continued_equals_at_once(quality: SolverSettings) -> None:
    start = np.array([2.0, 0.0])
    whole = integrate(oscillator, start, quality, until=3.0)
    parts = integrate(oscillator, start, quality, until=0.2)
    for until in (0.21, 1.7, 1.0, 3.0):
        parts = integrate(oscillator, start, quality, until, begin=parts)
    assert parts.steps == whole.steps
    assert same(parts, whole, whole.steps + 1)
    assert (parts.evaluations, parts.rejected) == (whole.evaluations, whole.rejected)


@pytest.mark.parametrize("quality", [*QUALITIES, SolverSettings("dopri5", tolerance=1e-2)], ids=str)
def test_counts_every_evaluation(quality: SolverSettings) -> None:
    calls = 0

    def counted(time: float, state: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        return oscillator(time, state)

    solution = integrate(counted, np.array([2.0, 0.0]), quality, until=8.0)
    assert solution.evaluations == calls


@pytest.mark.parametrize(("step", "count"), [(0.1, 3), (0.1, 1000), (1.0 / 120.0, 120), (0.05, 7)])
def test_nodes_are_multiples_of_the_step(step: float, count: int) -> None:
    """No drift, and an end that is a node up to rounding needs no further step."""
    solution = integrate(lambda _, y: -y, np.ones(1), SolverSettings("euler", step=step), until=count * step)
    assert solution.times == [index * step for index in range(count + 1)]
    ends = integrate(lambda _, y: -y, np.ones(1), SolverSettings("euler", step=step), until=round(count * step, 12))
    assert ends.steps == count


def test_outside_the_span_the_end_states_stand() -> None:
    solution = integrate(field, exact(0.0), SolverSettings("rk4", step=0.1), until=0.35)
    assert np.array_equal(solution.at(-1.0), solution.states[0])
    assert np.array_equal(solution.at(9.0), solution.states[-1])


@pytest.mark.parametrize("quality", QUALITIES, ids=str)
def test_blow_up_ends_early_with_finite_states(quality: SolverSettings) -> None:
    """y' = y^2, y(0) = 1 has its pole at t = 1; fixed steps may jump over it and overflow a little later."""
    with np.errstate(over="ignore", invalid="ignore"):
        solution = integrate(lambda _, y: y * y, np.array([1.0]), quality, until=10.0)
    assert solution.status is not Status.OK
    assert solution.end < 10.0
    assert np.isfinite(solution.states).all()
    assert np.isfinite(solution.at(10.0)).all()


@pytest.mark.parametrize("quality", QUALITIES, ids=str)
def test_field_without_values(quality: SolverSettings) -> None:
    solution = integrate(lambda _, y: y * math.nan, np.ones(3), quality, until=1.0)
    assert solution.status is Status.NON_FINITE
    assert solution.steps == 0
    assert np.array_equal(solution.at(0.5), np.ones(3))


@pytest.mark.parametrize("quality", QUALITIES, ids=str)
def test_field_that_loses_its_values(quality: SolverSettings) -> None:
    solution = integrate(lambda t, y: -y if t < 0.5 else y * math.nan, np.ones(3), quality, until=1.0)
    assert solution.status in (Status.NON_FINITE, Status.UNDERFLOW)
    assert 0.4 < solution.end <= 0.5
    assert np.isfinite(solution.states).all()
    steps = solution.steps
    again = integrate(lambda t, y: -y, np.ones(3), quality, until=1.0, begin=solution)
    assert again.steps == steps, "what has failed is not continued"


def test_step_limit() -> None:
    solution = integrate(lambda _, y: -y, np.ones(1), SolverSettings("euler", step=1e-6), until=1.0)
    assert solution.status is Status.MAX_STEPS
    assert 0.0 < solution.end < 1.0


@pytest.mark.parametrize(
    "setting",
    [
        {"method": "rk5", "step": 0.1},
        {"method": "rk4"},
        {"method": "dopri5", "step": 0.1, "tolerance": 1e-3},
        {"method": "rk4", "step": 0.0},
        {"method": "rk4", "step": -0.1},
        {"method": "rk4", "step": math.nan},
        {"method": "rk4", "tolerance": 1e-3},
        {"method": "dopri5", "tolerance": 0.0},
        {"method": "dopri5", "tolerance": math.nan},
    ],
    ids=str,
)
def test_impossible_qualities(setting: dict) -> None:
    with pytest.raises(InputError):
        SolverSettings(**setting)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("quality", QUALITIES, ids=str)
def test_many_times_at_once_are_each_time_alone(quality: SolverSettings, dtype: type) -> None:
    """To the last bit: what is shown of a moment must not depend on what else was asked for."""
    solution = integrate(oscillator, np.array([2.0, 0.0], dtype), quality, until=3.0)
    times = np.concatenate([[-1.0, 0.0, 9.0], np.random.default_rng(0).uniform(0.0, 3.2, 40), solution.times[3:5]])
    assert np.array_equal(solution.sample(times), np.stack([solution.at(float(time)) for time in times]))
    assert np.array_equal(solution.sample(times[5:6])[0], solution.at(float(times[5])))


def test_a_stiff_method_steps_fields_of_its_own_kind() -> None:
    with pytest.raises(InputError, match="solver limex: expected the field of a mechanical model"):
        integrate(field, exact(0.0), SolverSettings("limex", step=0.1), until=1.0)
