"""How thick a solid is behind each point of its surface."""

import numpy as np

from odeform.geometry.normals import vertex_normals
from odeform.geometry.rays import crossings
from odeform.types import Floats, Mesh, Perpoint

__all__ = ["median_thickness", "thicknesses"]


def median_thickness(surface: Mesh) -> float:
    """Returns the median of `thicknesses` in metres."""
    return float(np.median(thicknesses(surface)))


def thicknesses(surface: Mesh) -> Perpoint:
    """Computes (N,) metres from each vertex along its inward normal to the other side of a closed surface."""
    points = np.asarray(surface.points, dtype=float)
    inward = -vertex_normals(points, surface.faces)
    a, b, c = (points[surface.faces[:, i]] for i in range(3))
    found = np.empty(len(points))
    for index, (origin, direction) in enumerate(zip(points, inward, strict=True)):
        found[index] = _first_hit(origin, direction, a, b - a, c - a)
    return found


def _first_hit(origin: Floats, direction: Floats, corner: Floats, first: Floats, second: Floats) -> float:
    """Distance to the nearest of the triangles along a ray; infinite without any."""
    distance, _, _ = crossings(origin, direction, corner, first, second)
    size = np.sqrt(np.abs(first).max())
    return float(distance[distance > 1e-4 * size].min(initial=np.inf))
