"""How thick a solid is behind each point of its surface."""

import numpy as np

from odeform.geometry.contact import SurfacePoint
from odeform.geometry.normals import vertex_normals
from odeform.geometry.push import contact_axes
from odeform.geometry.rays import crossings
from odeform.types import Floats, Mesh, Perpoint

__all__ = ["median_thickness", "thickness_at", "thicknesses"]

ASLANT, AROUND = np.radians(45.0), 8  # angle of further rays with the inward normal, and their number


def median_thickness(surface: Mesh) -> float:
    """Returns the median of `thicknesses` in metres."""
    return float(np.median(thicknesses(surface)))


def thicknesses(surface: Mesh) -> Perpoint:
    """Computes (N,) metres from each vertex along its inward normal to the other side of a closed surface."""
    points = np.asarray(surface.points, dtype=float)
    inward = -vertex_normals(points, surface.faces)
    triangles = _triangles(surface)
    found = np.empty(len(points))
    for index, (origin, direction) in enumerate(zip(points, inward, strict=True)):
        found[index] = _first_hit(origin, direction, *triangles)
    return found


def thickness_at(surface: Mesh, contact: SurfacePoint) -> float:
    """Returns metres of a closed surface's inside behind a contact: to the other side, or less where it is narrow.

    A muzzle is long behind its tip, and gives way all the same: so the median over rays at 45 degrees to the inward
    normal counts as well, if that is less (as the shape diameter of Shapira et al. 2008).
    """
    inward, side, up = contact_axes(contact.normal)
    triangles, angles = _triangles(surface), np.arange(AROUND) * 2.0 * np.pi / AROUND
    around = np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * up
    slanted = np.cos(ASLANT) * inward + np.sin(ASLANT) * around
    aslant = float(np.median([_first_hit(contact.point, ray, *triangles) for ray in slanted]))
    return min(_first_hit(contact.point, inward, *triangles), aslant)


def _triangles(surface: Mesh) -> tuple[Floats, Floats, Floats]:
    """(F, 3) m: a corner of each triangle, and the two sides from it."""
    a, b, c = (np.asarray(surface.points, dtype=float)[surface.faces[:, i]] for i in range(3))
    return a, b - a, c - a


def _first_hit(origin: Floats, direction: Floats, corner: Floats, first: Floats, second: Floats) -> float:
    """Distance to the nearest of the triangles along a ray; infinite without any."""
    distance, _, _ = crossings(origin, direction, corner, first, second)
    size = np.sqrt(np.abs(first).max())
    return float(distance[distance > 1e-4 * size].min(initial=np.inf))
