"""Eight threads on one motion find what one finds, to the bit."""

import numpy as np
import pytest
from threads import THREADS, all_at_once

import odeform
from odeform.motion.base import Motion

TIMES = np.random.default_rng(0).permutation(np.linspace(0.05, 1.6, 8 * THREADS)).reshape(THREADS, 8)
"""Windows."""


def solved(name: str) -> Motion:
    predictor = odeform.load(name)
    return predictor.solve(until=0.5 * predictor.schema.window.stop)


def asked(motion: Motion, windows: np.ndarray) -> list[np.ndarray]:
    times = windows * motion.schema.window.stop
    each = [motion.vertices(float(time)) for time in times]
    return [*each, motion.vertices(times[:3]), motion.pose(times), motion.local(float(times[0]))]


@pytest.mark.parametrize("name", ["kick", "mass-elastic", "contact-force"])
def test_a_motion_is_the_same_for_all_threads(name: str) -> None:
    shared = solved(name)
    found = all_at_once(lambda windows: asked(shared, windows), list(TIMES))
    alone = solved(name)
    for here, windows in zip(found, TIMES, strict=True):
        for one, other in zip(here, asked(alone, windows), strict=True):
            np.testing.assert_array_equal(one, other)
