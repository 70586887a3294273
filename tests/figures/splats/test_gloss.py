"""Highlights that move with the view."""

import numpy as np

from odeform.geometry.harmonics import harmonic_basis
from odeform.types import GaussianSplats
from odeform_figures.splats.gloss import glossy


def test_a_highlight_is_seen_where_light_is_mirrored() -> None:
    normals = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
    base = np.tile([[[0.3, -0.2, 0.1]]], (2, 1, 1))
    plain = GaussianSplats(normals, np.tile(1e-6 * np.eye(3), (2, 1, 1)), base, np.ones(2))
    toward_light = np.array([0.6, 0.0, 0.8])
    shone = glossy(plain, normals, toward_light, 0.5)
    directions = np.random.default_rng(1).standard_normal((4000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    added = harmonic_basis(directions, 3) @ (shone.harmonics - np.pad(base, ((0, 0), (0, 15), (0, 0))))
    np.testing.assert_allclose(added[..., 0], added[..., 2], atol=1e-6)
    for index, normal in enumerate(normals):
        mirrored = 2.0 * (normal @ toward_light) * normal - toward_light  # from the splat towards the eye
        brightest = -directions[added[index, :, 0].argmax()]
        assert np.degrees(np.arccos(brightest @ mirrored)) < 15.0
        assert 0.25 < added[index, :, 0].max() < 0.6
    assert glossy(plain, normals, toward_light, 0.0).harmonics[:, 1:].max() == 0.0
