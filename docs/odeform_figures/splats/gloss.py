"""Highlights on splats, as harmonics: what a capture has where a surface is smooth."""

from dataclasses import replace

import numpy as np

from odeform.geometry.directions import even_directions
from odeform.geometry.harmonics import harmonic_basis
from odeform.types import GaussianSplats, Points, Vector, Vectors

__all__ = ["glossy"]

DEGREE = 3
SHARP = 6.0  # exponent of Phong's lobe; harmonics of degree 3 hold no sharper one
DIRECTIONS, BLOCK = 256, 4096


def glossy(splats: GaussianSplats, normals: Vectors, toward_light: Vector, strength: float) -> GaussianSplats:
    """Adds a white highlight to splats with unit `normals` (N, 3), by Phong's model: it moves with the view."""
    directions = even_directions(DIRECTIONS)
    basis = harmonic_basis(directions, DEGREE) * (4.0 * np.pi / DIRECTIONS)
    added = np.concatenate(
        [_lobe(directions, normals[at : at + BLOCK], toward_light) @ basis for at in range(0, len(normals), BLOCK)]
    )
    harmonics = np.repeat(strength * added[:, :, None], 3, axis=2)
    harmonics[:, 0] += splats.harmonics[:, 0]
    return replace(splats, harmonics=harmonics.astype(np.float32))


def _lobe(directions: Vectors, normals: Points, toward_light: Vector) -> np.ndarray:
    """(N, D) brightness of a surface that is looked at along each of the directions."""
    facing = normals @ directions.T
    mirrored = (directions @ toward_light) - 2.0 * facing * (normals @ toward_light)[:, None]
    return np.where(facing < 0.0, np.maximum(mirrored, 0.0) ** SHARP, 0.0)
