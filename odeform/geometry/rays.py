"""Finds what a ray meets: the triangles of a mesh, or the points of a cloud."""

import numpy as np

from odeform.types import Faces, Floats, Points, Vector

__all__ = ["crossings", "first_on_mesh", "first_on_points"]

ROUNDING = 1e-9  # of a triangle: rays through its edges hit it


def crossings(
    origin: Floats, direction: Floats, corner: Floats, first: Floats, second: Floats
) -> tuple[Floats, Floats, Floats]:
    """Returns the distance along a ray to each of F triangles, and where in them (Moeller and Trumbore 1997).

    A triangle is given by a `corner` (F, 3) and the sides `first` and `second` (F, 3) from it. The distances (F,) are
    in lengths of `direction` (3,), negative behind `origin` (3,), and infinite without a crossing; the crossing is at
    corner + u first + v second, with u and v (F,).
    """
    across = np.cross(direction, second)
    volume = (first * across).sum(axis=1)
    away = origin - corner
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (away * across).sum(axis=1) / volume
        turned = np.cross(away, first)
        v = turned @ direction / volume
        distance = (second * turned).sum(axis=1) / volume
        hit = (u >= -ROUNDING) & (v >= -ROUNDING) & (u + v <= 1.0 + ROUNDING)
    return np.where(hit, distance, np.inf), u, v


def first_on_mesh(origin: Floats, direction: Floats, points: Points, faces: Faces) -> tuple[int, Vector, float] | None:
    """Finds the first face that a ray from (3,) along (3,) meets, the barycentric coordinates (3,) there, and the
    distance in lengths of `direction`; None if it meets none."""
    a, b, c = (np.asarray(points, dtype=float)[faces[:, i]] for i in range(3))
    distance, u, v = crossings(np.asarray(origin, dtype=float), np.asarray(direction, dtype=float), a, b - a, c - a)
    distance = np.where(distance > 0.0, distance, np.inf)
    face = int(distance.argmin())
    if not np.isfinite(distance[face]):
        return None
    return face, np.array([1.0 - u[face] - v[face], u[face], v[face]]), float(distance[face])


def first_on_points(origin: Floats, direction: Floats, points: Points, radius: float) -> tuple[int, float] | None:
    """Finds the first of (N, 3) m points within `radius` m of a ray, and its distance in lengths of `direction`.

    Of points that are nearly as near as the first (by less than `radius`), it is the one closest to the ray.
    """
    size = float(np.linalg.norm(direction))
    along = np.asarray(direction, dtype=float) / size
    away = np.asarray(points, dtype=float) - origin
    depth = away @ along
    aside = np.sqrt(np.maximum((away**2).sum(axis=1) - depth**2, 0.0))
    near = np.flatnonzero((aside < radius) & (depth > 0.0))
    if not len(near):
        return None
    front = near[depth[near] < depth[near].min() + radius]
    index = int(front[aside[front].argmin()])
    return index, float(depth[index] / size)
