"""Morph targets: few where frames have something in common, one per frame otherwise, always within the tolerance."""

import numpy as np
import pytest

from odeform.formats.morph_targets import morph_targets


@pytest.mark.parametrize(("rank", "tolerance"), [(3, 1e-6), (12, 1e-6), (12, 0.5)])
def test_within_the_tolerance_with_as_few_as_possible(rank: int, tolerance: float) -> None:
    rng = np.random.default_rng(rank)
    frames = np.einsum("tk,kni->tni", rng.normal(size=(12, rank)), 0.1 * rng.normal(size=(rank, 50, 3)))
    targets, weights = morph_targets(frames, tolerance)
    assert len(targets) == weights.shape[1] <= rank
    assert np.linalg.norm(np.einsum("tk,kni->tni", weights, targets) - frames, axis=2).max() <= tolerance + 1e-7
    assert np.allclose(np.abs(weights).max(axis=0), 1.0)
    assert tolerance > 0.1 or len(targets) == rank


def test_nothing_moves() -> None:
    targets, weights = morph_targets(np.zeros((4, 5, 3)), 1e-6)
    assert targets.shape == (0, 5, 3)
    assert weights.shape == (4, 0)
