"""Steps in machine code and in NumPy, side by side."""

import numpy as np

from odeform.mechanics.push import Push
from odeform.mechanics.pushed_batch import CompiledBodies, PushedBodies
from odeform.mechanics.step import Mechanics
from odeform.types import Floats

STEPS = np.array([1e-3, 7e-4])  # s, of two motions


def assert_same_steps(
    mechanics: Mechanics, push: Push, start: Floats, count: int, without: Push
) -> tuple[Floats, float]:
    """Follow two motions from `start`, both ways to rounding; returns where they end, and by how much a step differs at
    most from that of the push `without` something."""
    reference, compiled = (kind(mechanics, push, 0.0) for kind in (PushedBodies, CompiledBodies))
    other, rows, states, apart = CompiledBodies(mechanics, without, 0.0), np.arange(2), start, 0.0
    for index in range(count):
        times = index * STEPS
        known, found = (each.advance(rows, times, states, STEPS) for each in (reference, compiled))
        for one, two in zip(known, found, strict=True):
            np.testing.assert_allclose(two, one, rtol=1e-8, atol=1e-9 * np.abs(one).max())
        slopes = reference(rows, times, states)
        np.testing.assert_allclose(compiled(rows, times, states), slopes, rtol=1e-8, atol=1e-9 * np.abs(slopes).max())
        apart = max(apart, float(np.abs(other.advance(rows, times, states, STEPS)[0] - known[0]).max()))
        states = known[0]
    return states, apart
