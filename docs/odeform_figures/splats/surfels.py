"""Flat splats that tile surfaces, for procedural scenes."""

from dataclasses import dataclass

import numpy as np

from odeform.types import SH0, Floats, GaussianSplats, Points, Vector, Vectors

__all__ = ["COVER", "Surfels", "grid", "joined_surfels", "splats_of", "tiles"]

THICKNESS = 2e-4  # m, one standard deviation
COVER = 0.62  # standard deviations a pitch: neighbours overlap until no gap shows
OPACITY = 0.97


@dataclass(frozen=True, eq=False)
class Surfels:
    """`points` (N, 3) m, unit tangents `along` and `across` (N, 3), `sizes` (N, 2) standard deviations in m, `colors`
    (N, 3) in [0, 1]."""

    points: Points
    along: Vectors
    across: Vectors
    sizes: Floats
    colors: Points


def grid(one: Floats, other: Floats) -> tuple[Floats, Floats]:
    """Returns the (N,) coordinates of all pairs."""
    first, second = np.meshgrid(one, other)
    return first.ravel(), second.ravel()


def tiles(
    corner: Vector, along: Vector, across: Vector, at: Floats, pitch: Floats, colors: Points, cover: float = COVER
) -> Surfels:
    """Tiles in a plane: at (N, 2) m from `corner` along two unit vectors, with a pitch of (N, 2) or (2,) m."""
    count = len(at)
    points = corner + at[:, :1] * along + at[:, 1:] * across
    sizes = np.broadcast_to(cover * pitch, (count, 2))
    return Surfels(points, np.tile(along, (count, 1)), np.tile(across, (count, 1)), sizes, colors)


def joined_surfels(parts: list[Surfels]) -> Surfels:
    """Returns all parts as one."""
    return Surfels(*(np.concatenate([vars(part)[name] for part in parts]) for name in vars(parts[0])))


def splats_of(surfels: Surfels) -> GaussianSplats:
    """Returns the surfels as flat Gaussian splats."""
    normals = np.cross(surfels.along, surfels.across)
    axes = [surfels.along * surfels.sizes[:, :1], surfels.across * surfels.sizes[:, 1:], THICKNESS * normals]
    half = np.stack(axes, axis=2)
    return GaussianSplats(
        surfels.points.astype(np.float32),
        half @ half.swapaxes(1, 2),
        ((np.clip(surfels.colors, 0.0, 1.0) - 0.5) / SH0).astype(np.float32)[:, None],
        np.full(len(half), OPACITY),
    )
