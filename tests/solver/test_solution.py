"""What is between the nodes, and solutions that threads and processes share."""

import pickle

import numpy as np
import pytest
from threads import THREADS, all_at_once

from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.solution import Solution, Status

SETTINGS = [
    SolverSettings("rk4", step=2e-3),
    SolverSettings("bosh3", tolerance=1e-6),
    SolverSettings("dopri5", tolerance=1e-9),
]


def swinging(_: float, state: np.ndarray) -> np.ndarray:
    return np.array([state[1], -np.sin(state[0])])


def begun(settings: SolverSettings) -> Solution:
    return integrate(swinging, np.array([2.0, 0.0]), settings, until=0.1)


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_threads_that_continue_one_solution_find_what_one_finds(settings: SolverSettings) -> None:
    asked = [np.random.default_rng(seed).uniform(0.0, 4.0, 5) for seed in range(THREADS)]

    def states(solution: Solution, times: np.ndarray) -> np.ndarray:
        integrate(swinging, solution.states[0], settings, float(times.max()), begin=solution)
        return solution.sample(times)

    shared, alone = begun(settings), begun(settings)
    found = all_at_once(lambda times: states(shared, times), asked)
    expected = [states(alone, times) for times in asked]
    np.testing.assert_array_equal(found, expected)
    assert shared.times == alone.times
    assert (shared.evaluations, shared.rejected) == (alone.evaluations, alone.rejected)


def test_a_solution_can_be_read_while_it_grows() -> None:
    settings = SETTINGS[0]
    solution, whole = begun(settings), integrate(swinging, np.array([2.0, 0.0]), settings, until=4.0)

    def act(thread: int) -> bool:
        if not thread:
            integrate(swinging, solution.states[0], settings, 4.0, begin=solution)
            return True
        ends = [solution.sample(np.array([9.0, 9.0]))[0] for _ in range(200)]
        return all(any(np.array_equal(end, state) for state in whole.states) for end in ends)

    assert all(all_at_once(act, range(THREADS)))


def test_a_pickled_solution_goes_on_as_the_first_does() -> None:
    for settings in SETTINGS:
        solution = begun(settings)
        copy: Solution = pickle.loads(pickle.dumps(solution))
        steps = copy.steps
        one, other = (integrate(swinging, s.states[0], settings, 2.0, begin=s) for s in (solution, copy))
        assert other.steps > steps
        np.testing.assert_array_equal(one.sample(np.linspace(0, 2, 30)), other.sample(np.linspace(0, 2, 30)))
        assert other.times == one.times


def test_nodes_come_in_whole() -> None:
    solution = Solution([0.0], [np.zeros(1)], [np.ones(1)])
    solution.append(2.0, np.array([2.0]), np.ones(1), np.array([1.5]))
    assert (solution.steps, solution.end, solution.status) == (1, 2.0, Status.OK)
    # the cubic through both nodes is a line; the state at the middle bends it
    assert solution.at(1.0)[0] == 1.5
    assert solution.at(0.5)[0] == pytest.approx(0.5 + 0.5 * 16 * 0.25**2 * 0.75**2)
