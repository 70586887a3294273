"""Signed distances of simple solids, negative inside, and their smooth combinations.

After Quilez, "Distance functions" and "Smooth minimum".

Points are (N, 3) in metres; every function returns (N,) metres. Combined distances are bounds: exact at the surface,
where alone they are used, and of the right sign elsewhere.
"""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from odeform.types import Floats, Perpoint, Points

__all__ = ["capsule", "ellipsoid", "mirrored", "smooth_intersection", "smooth_union", "tube"]

Position = Sequence[float] | Floats


def smooth_union(first: Perpoint, second: Perpoint, blend: float) -> Perpoint:
    """Returns the union of two solids, with a fillet about `blend` metres wide where they meet."""
    fraction = np.clip(0.5 + 0.5 * (second - first) / blend, 0.0, 1.0)
    return second * (1.0 - fraction) + first * fraction - blend * fraction * (1.0 - fraction)


def smooth_intersection(first: Perpoint, second: Perpoint, blend: float) -> Perpoint:
    """Returns the intersection of two solids, with edges rounded over about `blend` metres."""
    return -smooth_union(-first, -second, blend)


def ellipsoid(points: Points, centre: Sequence[float], radii: Sequence[float], pitch: float = 0.0) -> Perpoint:
    """An ellipsoid; `pitch` radians raise its +x end."""
    local = _pitched(points - np.asarray(centre), -pitch)
    scaled = np.linalg.norm(local / np.asarray(radii), axis=1)
    gradient = np.linalg.norm(local / np.square(radii), axis=1)
    return scaled * (scaled - 1.0) / np.maximum(gradient, 1e-12)


def capsule(points: Floats, start: Position, end: Position, radius: float, end_radius: float | None = None) -> Perpoint:
    """A round rod from `start` to `end`, tapering from `radius` to `end_radius`; in the plane, points are (N, 2)."""
    axis = np.subtract(end, start)
    away = points - np.asarray(start)
    fraction = np.clip(away @ axis / (axis @ axis), 0.0, 1.0)
    taper = 0.0 if end_radius is None else end_radius - radius
    return np.linalg.norm(away - fraction[:, None] * axis, axis=1) - (radius + taper * fraction)


def tube(points: Points, path: Sequence[Sequence[float]], radius: float, end_radius: float) -> Perpoint:
    """Makes a round tube along the cubic spline through `path` (K, 3) m, tapering from `radius` to `end_radius`."""
    knots = np.asarray(path, dtype=float)
    centres = CubicSpline(np.arange(len(knots)), knots)(np.linspace(0.0, len(knots) - 1.0, 24))
    radii = np.linspace(radius, end_radius, len(centres))
    ends = zip(centres[:-1], centres[1:], radii[:-1], radii[1:], strict=True)
    return np.min([capsule(points, *segment) for segment in ends], axis=0)


def mirrored(points: Points) -> Points:
    """The points with |y| for y: a part that is described on the left is then there on both sides."""
    return points * [1.0, 0.0, 1.0] + np.abs(points) * [0.0, 1.0, 0.0]


def _pitched(points: Points, angle: float) -> Floats:
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y, z = points.T
    return np.stack([cosine * x - sine * z, y, sine * x + cosine * z], axis=1)
