"""Finds where a sphere touches a surface and a force pushes it inward: the contacts of `contact-force`."""

import math
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import igl
import numpy as np
import trimesh

from odeform.errors import InputError
from odeform.geometry.normals import vertex_normals
from odeform.types import Faces, Floats, Mesh, Points, Vector

__all__ = [
    "CONE",
    "RADIUS",
    "SNAP",
    "SurfacePoint",
    "checked_contact",
    "nearest_on",
    "projectile_centre",
    "surface_point",
    "touching_centre",
]

RADIUS = 0.020  # m, of the sphere: about a golf ball
CONE = math.radians(45.0)  # largest angle between a force and the inward normal
SNAP = 0.005  # m; a contact at most this far off the surface counts as its nearest point
CREVICE = 0.001  # m by which a sphere may stand further off than its radius: more, and another part is in its way


@dataclass(frozen=True, eq=False)
class SurfacePoint:
    """A point of a mesh."""

    point: Vector
    """(3,) m."""
    normal: Vector
    """(3,) outward unit normal, interpolated between those of the vertices: continuous over the whole surface."""
    face: int
    """Index of the face."""
    barycentric: Vector
    """(3,) barycentric coordinates in that face."""
    distance: float = 0.0
    """Metres to the point that it is nearest to."""

    def moved(self, vertices: Points, faces: Faces) -> Vector:
        """(3,) m: where the point is once the vertices of the mesh are at `vertices` (N, 3) m."""
        return self.barycentric @ np.asarray(vertices, dtype=float)[faces[self.face]]


class _Surface:
    """Holds what all searches of nearest points on a mesh need."""

    def __init__(self, mesh: Mesh) -> None:
        self.points = np.ascontiguousarray(mesh.points, dtype=float)
        self.faces = np.ascontiguousarray(mesh.faces, dtype=np.int64)
        self.normals = vertex_normals(self.points, mesh.faces)
        self._tree = igl.AABB()
        self._tree.init(self.points, self.faces)

    def nearest(self, point: Floats) -> tuple[float, int, Vector]:
        """The distance of a point (3,) m from the surface in m, the face that is nearest to it, and where that is."""
        found: Any = self._tree.squared_distance(self.points, self.faces, point[None])
        squares, faces, feet = found
        return math.sqrt(squares[0]), int(faces[0]), feet[0]


_surfaces: WeakKeyDictionary[Mesh, _Surface] = WeakKeyDictionary()


def _surface_of(mesh: Mesh) -> _Surface:
    found = _surfaces.get(mesh)
    if found is None:
        found = _surfaces[mesh] = _Surface(mesh)
    return found


def surface_point(mesh: Mesh, face: int, barycentric: Floats, distance: float = 0.0) -> SurfacePoint:
    """Returns the point of a face with barycentric coordinates `barycentric` (3,)."""
    surface = _surface_of(mesh)
    corners = surface.points[surface.faces[face]]
    normal = np.asarray(barycentric) @ surface.normals[mesh.faces[face]]
    size = float(np.linalg.norm(normal))
    if size < 1e-9:
        a, b, c = corners
        normal = np.cross(b - a, c - a)
        size = max(float(np.linalg.norm(normal)), 1e-20)
    return SurfacePoint(np.asarray(barycentric) @ corners, normal / size, int(face), np.asarray(barycentric), distance)


def nearest_on(mesh: Mesh, point: Floats) -> SurfacePoint:
    """The point of a mesh that is nearest to `point` (3,) m."""
    surface = _surface_of(mesh)
    distance, face, foot = surface.nearest(np.asarray(point, dtype=float))
    barycentric = trimesh.triangles.points_to_barycentric(surface.points[surface.faces[face]][None], foot[None])[0]
    barycentric = barycentric if np.isfinite(barycentric).all() else np.full(3, 1.0 / 3.0)
    return surface_point(mesh, face, barycentric, distance)


def touching_centre(mesh: Mesh, contact: SurfacePoint) -> Vector | None:
    """(3,) m: centre of the sphere that touches the surface at a contact; None where it does not fit.

    The centre lies on the outward normal, at the distance at which the sphere touches the faces: its radius on flat
    and convex parts. It does not fit where another part of the surface or the floor z = 0 is in its way.
    """
    surface, height = _surface_of(mesh), RADIUS
    for _ in range(20):
        centre = contact.point + height * contact.normal
        gap = RADIUS - surface.nearest(centre)[0]
        height += gap
        if height > RADIUS + CREVICE or centre[2] < RADIUS:
            return None
        if abs(gap) < 1e-7:
            break
    return contact.point + height * contact.normal


def checked_contact(mesh: Mesh, point: Floats, force: Floats) -> tuple[SurfacePoint, Vector]:
    """Finds the contact nearest to `point` (3,) m, and the centre of the sphere there, for a `force` (3,) N.

    A force outside of the cone is accepted, as long as it pushes inward; no force is, too.

    Raises:
        InputError: The point is more than 5 mm off the surface, the sphere does not fit there, or the force pulls away
            from the surface.
    """
    contact = nearest_on(mesh, point)
    if contact.distance > SNAP:
        raise InputError(
            f"contact: expected a point within {1e3 * SNAP:g} mm of the surface, "
            f"got one {1e3 * contact.distance:.1f} mm off it"
        )
    if float(np.dot(contact.normal, force)) > 1e-9:
        raise InputError(
            "force: expected one that pushes into the surface at the contact, got one that pulls away from it; the "
            f"inward normal is {', '.join(f'{x:.2f}' for x in -contact.normal)}"
        )
    centre = touching_centre(mesh, contact)
    if centre is None:
        raise InputError(
            f"contact: a sphere of radius {1e3 * RADIUS:g} mm does not fit there: the floor or another part of the "
            "body is in its way"
        )
    return contact, centre


def projectile_centre(contact: SurfacePoint, centre: Floats, force: Floats, moved: Floats) -> Vector:
    """(3,) m: where the sphere is while it pushes, once the surface at the contact is at `moved` (3,) m.

    It starts at `centre` (3,) m, and a guide lets it move along the force (3,) only. It is taken to move as far as the
    point that it touches.
    """
    size = float(np.linalg.norm(force))
    direction = np.asarray(force, dtype=float) / size if size else -contact.normal
    return np.asarray(centre, dtype=float) + float((np.asarray(moved) - contact.point) @ direction) * direction
