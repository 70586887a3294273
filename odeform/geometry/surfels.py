"""Flat splats that tile surfaces: what scenes are made of whose splats come from a formula, not from photographs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from odeform.types import SH0, Floats, GaussianSplats, Perpoint, Points, Vectors

__all__ = ["Surfels", "sphere_surfels", "splats_of", "tiles"]

THICKNESS = 4e-4  # m, one standard deviation
COVER = 0.62  # standard deviations a pitch: neighbours overlap until no gap shows
OPACITY = 0.97


@dataclass(frozen=True, eq=False)
class Surfels:
    """`points` (N, 3) m, unit tangents `along` and `across` (N, 3), `sizes` (N, 2) standard deviations in m."""

    points: Points
    along: Vectors
    across: Vectors
    sizes: Floats


def tiles(corner: Floats, along: Floats, across: Floats, centres: Floats, pitch: Floats) -> Surfels:
    """In a plane through `corner`: `centres` (N, 2) m along two unit vectors, each as large as its `pitch` (N, 2) m."""
    points = corner + centres[:, :1] * along + centres[:, 1:] * across
    return Surfels(points, np.tile(along, (len(points), 1)), np.tile(across, (len(points), 1)), COVER * pitch)


def sphere_surfels(centre: Floats, radius: float, count: int) -> Surfels:
    """Round ones along a Fibonacci spiral, each of the same share of a sphere."""
    index = np.arange(count) + 0.5
    z, angle = 1.0 - 2.0 * index / count, index * np.pi * (3.0 - np.sqrt(5.0))
    flat = np.sqrt(1.0 - z**2)
    normals = np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)
    along = np.stack([-np.sin(angle), np.cos(angle), np.zeros(count)], axis=1)
    pitch = radius * np.sqrt(4.0 * np.pi / count)
    return Surfels(centre + radius * normals, along, np.cross(normals, along), np.full((count, 2), COVER * pitch))


def splats_of(parts: Sequence[tuple[Surfels, Points, Perpoint]]) -> GaussianSplats:
    """Surfels, with their colours (N, 3) and shares of `OPACITY` (N,), as splats."""
    halves, colors, opacities = [], [], []
    for surfels, color, opacity in parts:
        normals = np.cross(surfels.along, surfels.across)
        columns = [surfels.along * surfels.sizes[:, :1], surfels.across * surfels.sizes[:, 1:], THICKNESS * normals]
        halves.append(np.stack(columns, axis=2))
        colors.append(np.clip(color, 0.0, 1.0))
        opacities.append(OPACITY * opacity)
    half = np.concatenate(halves)
    return GaussianSplats(
        np.concatenate([surfels.points for surfels, _, _ in parts]).astype(np.float32),
        half @ half.swapaxes(1, 2),
        ((np.concatenate(colors) - 0.5) / SH0).astype(np.float32)[:, None],
        np.concatenate(opacities),
    )
