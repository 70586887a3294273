"""A corn chip: a rounded triangle, bent to a saddle."""

import numpy as np

from odeform.types import Floats, Mesh, Perpoint
from odeform_figures.bodies.signed_distance import capsule
from odeform_figures.bodies.triangles import triangulate

__all__ = ["RANGES", "chip"]

RANGES = {"size": (0.85, 1.2), "length": (0.85, 1.2), "saddle": (0.5, 1.5), "corners": (0.7, 1.3)}

CORNER = 0.029  # m from the centre to that of a corner
ROUNDING = 0.009  # m, radius of the corners
EDGE = 0.00165  # m


def chip(size: float = 1.0, length: float = 1.0, saddle: float = 1.0, corners: float = 1.0) -> Mesh:
    """The middle surface of the chip, an open mesh in metres. The arguments are factors on its proportions."""

    def outline(points: Floats) -> Perpoint:
        return _rounded_triangle(points, ROUNDING * corners)

    # as many vertices for every rounding
    edge = EDGE * np.sqrt(_area(ROUNDING * corners) / _area(ROUNDING))
    plane, faces = triangulate(outline, 2.0 * CORNER, edge)
    x, y = plane.T * np.array([[length * size], [size]])
    return Mesh(np.stack([x, y, saddle / size * (4.5 * x**2 - 4.0 * y**2)], axis=1), faces)


def _rounded_triangle(points: Floats, rounding: float) -> Perpoint:
    """(N,) signed distance in metres to a triangle around the origin that points to +x, of points (N, 2)."""
    angles = np.radians([0.0, 120.0, 240.0])
    corners = CORNER * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    sides = [capsule(points, corners[i], corners[i - 1], 0.0) for i in range(3)]
    outside = (points @ -corners.T).max(axis=1) > 0.5 * CORNER**2
    return np.where(outside, 1.0, -1.0) * np.min(sides, axis=0) - rounding


def _area(rounding: float) -> float:
    return np.sqrt(27.0) * (0.25 * CORNER + rounding) * CORNER + np.pi * rounding**2
