"""Even triangles in the plane (Persson and Strang 2004, "A simple mesh generator in MATLAB")."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import Delaunay

from odeform.types import Faces, Floats, Perpoint

__all__ = ["triangulate"]

STIFFNESS, STRETCH, ROUNDS = 0.2, 1.2, 120  # of the springs between neighbours; they start compressed

SLIVER = 0.1  # smallest area of a triangle, in squares of the edge; an even one has 0.43


def triangulate(outline: Callable[[Floats], Perpoint], extent: float, edge: float) -> tuple[Floats, Faces]:
    """Makes vertices (N, 2) m and counter-clockwise triangles (F, 3) with edges of about `edge` m.

    `outline` maps points (N, 2) m to signed distances (N,) m, negative inside; all of that is within `extent` m of the
    origin.
    """
    rows = np.arange(-extent, extent, 0.5 * np.sqrt(3.0) * edge)
    x, y = np.meshgrid(np.arange(-extent, extent, edge), rows)
    x[1::2] += 0.5 * edge
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    points = points[outline(points) < 1e-3 * edge]
    for _ in range(ROUNDS):
        triangles = _inside(points, outline, edge)
        bars = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
        along = points[bars[:, 0]] - points[bars[:, 1]]
        length = np.linalg.norm(along, axis=1)
        wanted = STRETCH * np.sqrt((length**2).mean())
        push = STIFFNESS * (np.maximum(wanted - length, 0.0) / length)[:, None] * along
        move = np.zeros_like(points)
        np.add.at(move, bars[:, 0], push)
        np.add.at(move, bars[:, 1], -push)
        points = _pulled_in(points + move, outline, edge)
    return points, _inside(points, outline, edge)


def _inside(points: Floats, outline: Callable[[Floats], Perpoint], edge: float) -> Faces:
    triangles = Delaunay(points).simplices
    corners = points[triangles]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    # slivers along the outline are left out: their corners are nearly in line
    kept = (outline(corners.mean(axis=1)) < -1e-3 * edge) & (area > SLIVER * edge**2)
    return triangles[kept].astype(np.int32)


def _pulled_in(points: Floats, outline: Callable[[Floats], Perpoint], edge: float) -> Floats:
    """The points, those outside moved to the outline."""
    away = outline(points)
    beyond = away > 0.0
    small = 1e-4 * edge
    slope = np.stack([(outline(points[beyond] + step) - away[beyond]) / small for step in small * np.eye(2)], axis=1)
    points[beyond] -= away[beyond, None] * slope / np.maximum((slope**2).sum(axis=1, keepdims=True), 1e-12)
    return points
