"""Motions are large, and a slider makes dozens a second: each is freed as soon as nothing uses it."""

import gc
import weakref
from collections.abc import Iterator

import numpy as np
import pytest

from odeform.models.registry import load


@pytest.fixture
def no_search_for_cycles() -> Iterator[None]:
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.mark.parametrize("name", ["kick", "kick/gp", "mass-elastic", "mass-elastic/direct", "contact-force"])
@pytest.mark.usefixtures("no_search_for_cycles")
def test_a_motion_that_was_looked_at_is_freed(name: str) -> None:
    motion = load(name).solve()
    motion.vertices(np.array([0.05, 0.1]))
    motion.deformation_rms(np.array([0.1]))
    assert motion.status
    alive = weakref.ref(motion)
    del motion
    assert alive() is None
