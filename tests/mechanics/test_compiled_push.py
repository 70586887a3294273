"""Compiled steps of pushed bodies are those of the NumPy code."""

import numpy as np
import pytest
from soft_block import SIZE, Block

from odeform.compiling import compiles
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.flat import parts_of
from odeform.mechanics.push import make_push
from odeform.mechanics.pushed import PushedBody
from odeform.mechanics.pushed_batch import CompiledBodies, PushedBodies
from odeform.mechanics.step import Mechanics, Projectile
from odeform.solver.integrate import SolverSettings, integrate
from odeform.types import Floats

pytestmark = pytest.mark.skipif(not compiles(), reason="needs Numba")

CONTACTS = np.array([[0.5 * SIZE[0], 0.01, 0.01], [0.5 * SIZE[0], -0.01, 0.02], [0.5 * SIZE[0], 0.0, -0.01]])
FORCES = np.array([[-3.0, 0.5, 0.0], [-1.0, 0.0, -2.0], [0.0, 0.0, 0.0]])
PULSE, STEP = 0.0205, 1e-3  # the pulse ends within a step


def bodies(block: Block) -> tuple[PushedBodies, CompiledBodies]:
    mechanics = Mechanics(block.body, ContactParameters(), Projectile(0.012, 0.020))
    push = make_push(block.body, 5, CONTACTS, CONTACTS + np.array([0.012, 0.0, 0.0]), FORCES)
    return PushedBodies(mechanics, push, PULSE), CompiledBodies(mechanics, push, PULSE)


def test_states_slopes_and_errors_agree_to_rounding(block: Block) -> None:
    reference, compiled = bodies(block)
    rows, steps, states = np.arange(3), np.full(3, STEP), reference.start
    for index in range(60):
        times = index * steps
        known, found = (each.advance(rows, times, states, steps) for each in (reference, compiled))
        for one, other in zip(known, found, strict=True):
            np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-10 * np.abs(one).max() + 1e-15)
        slopes = reference(rows, times, states)
        np.testing.assert_allclose(compiled(rows, times, states), slopes, rtol=1e-9, atol=1e-10 * np.abs(slopes).max())
        states = known[0]
    assert np.abs(states[:2, :3]).max() > 1e-3, "they have been pushed"


@pytest.mark.parametrize("begin", [0.0, 1.0], ids=["pushed", "free"])
@pytest.mark.parametrize("spin", [[0.0, 0.0, 0.0], [60.0, 0.0, 0.0], [0.0, -60.0, 20.0]])
def test_they_agree_for_bodies_that_fall_and_spin_fast(block: Block, spin: list[float], begin: float) -> None:
    """In long steps, whose errors are large, and in which contacts begin."""
    reference, compiled = bodies(block)
    rows, steps, states = np.arange(3), np.full(3, 4e-3), reference.start
    moving = parts_of(states)[-1].start
    states[:, 2], states[:, moving : moving + 6] = [4e-3, 5e-3, 2e-2], [0.1, 0.0, 0.0, *spin]
    states[:, moving + 2] = [-3.0, 0.0, -3.0]
    for index in range(10):
        times = begin + index * steps
        known, found = (each.advance(rows, times, states, steps) for each in (reference, compiled))
        for one, other in zip(known, found, strict=True):
            np.testing.assert_allclose(other, one, rtol=1e-8, atol=1e-8 * np.abs(one).max())
        states = known[0]
    assert (states[:, moving + 2] > -1.0).all(), "they have met the floor"


def test_a_motion_is_the_same_to_the_bit_in_any_batch(block: Block) -> None:
    _, compiled = bodies(block)
    rows, steps = np.arange(3), np.array([STEP, 0.5 * STEP, 2.0 * STEP])
    together = compiled.advance(rows, 0.0 * steps, compiled.start, steps)
    for row in range(3):
        some = slice(row, row + 1)
        alone = compiled.advance(rows[some], 0.0 * steps[some], compiled.start[some], steps[some])
        for one, all_of_them in zip(alone, together, strict=True):
            np.testing.assert_array_equal(one[0], all_of_them[row])


def test_what_is_not_finite_stays_so(block: Block) -> None:
    _, compiled = bodies(block)
    states = compiled.start
    states[0, 14] = np.nan
    after, slopes, errors = compiled.advance(np.arange(3), np.zeros(3), states, np.full(3, STEP))
    assert not np.isfinite(after[0]).all()
    assert not np.isfinite(errors[0])
    assert np.isfinite(after[1:]).all()
    assert np.isfinite(slopes[1:]).all()


@pytest.mark.parametrize("force", [0, 2], ids=["pushed", "at rest"])
def test_many_steps_at_once_are_single_steps_to_the_bit(block: Block, force: int) -> None:
    """With the end of the pulse, and more nodes than one call has room for."""
    mechanics = Mechanics(block.body, ContactParameters(), Projectile(0.012, 0.020))
    some = slice(force, force + 1)
    push = make_push(block.body, 5, CONTACTS[some], CONTACTS[some] + np.array([0.012, 0.0, 0.0]), FORCES[some])
    settings = SolverSettings("limex", tolerance=2e-6, dtype="float64")
    body = PushedBody(mechanics, push, PULSE)
    found = integrate(body, body.start, settings, 0.1)
    integrate(body, body.start, settings, 0.2, found)

    class Single:
        """The same field, of which only single steps are asked for."""

        def __call__(self, time: float, state: Floats) -> Floats:
            return body(time, state)

        def advance(self, time: float, state: Floats, step: float) -> tuple[Floats, Floats, float]:
            return body.advance(time, state, step)

    known = integrate(Single(), body.start, settings, 0.2)
    assert found.steps > 100 or force == 2
    assert (found.times, found.rejected, found.evaluations) == (known.times, known.rejected, known.evaluations)
    np.testing.assert_array_equal(np.stack(found.states), np.stack(known.states))
    np.testing.assert_array_equal(np.stack(found.slopes), np.stack(known.slopes))
