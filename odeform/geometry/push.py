"""A force at a contact, as people set it: its strength, and how far it is tilted off the inward normal."""

import math
from dataclasses import dataclass, replace

import numpy as np

from odeform.geometry.contact import CONE, SurfacePoint, surface_point, touching_centre
from odeform.types import Floats, Mesh, Rotations, Vector

__all__ = ["Push", "contact_axes", "default_contact", "push_of"]

STEEP = 0.99  # vertical part of a normal from which on "up" along the surface is the x axis
CANDIDATES = 600  # faces that a default contact is chosen from
TOWARDS = np.array([-0.6, -0.35, 0.72])  # where a default contact faces: up, and to the side that viewers look from
FAR = 1.2  # weight of the distance of a default contact from where a line along `TOWARDS` leaves the body


@dataclass(frozen=True, eq=False)
class Push:
    """A contact, and a force on the sphere that touches it."""

    contact: SurfacePoint
    strength: float
    """N."""
    up: float = 0.0
    """rad by which the force is tilted towards the upward direction along the surface (`contact_axes`)."""
    side: float = 0.0
    """rad to the side, likewise."""

    @property
    def direction(self) -> Vector:
        """(3,) unit vector along which the force acts."""
        inward, side, up = contact_axes(self.contact.normal)
        angle = self.angle
        if angle < 1e-12:
            return inward
        return math.cos(angle) * inward + math.sin(angle) / angle * (self.side * side + self.up * up)

    @property
    def force(self) -> Vector:
        """(3,) N."""
        return self.strength * self.direction

    @property
    def angle(self) -> float:
        """rad between the force and the inward normal."""
        return math.hypot(self.up, self.side)

    @property
    def steep(self) -> bool:
        """Whether the force leaves the cone that scenes draw forces from."""
        return self.angle > CONE + 1e-6

    def at(self, contact: SurfacePoint) -> "Push":
        """Returns the same force at another contact: as strong, and tilted as far off the normal there."""
        return replace(self, contact=contact)


def contact_axes(normal: Floats) -> Rotations:
    """Computes (3, 3) unit vectors as rows: into the surface, sideways and upwards along it, at an outward unit normal
    (3,)."""
    reference = np.array([0.0, 0.0, 1.0] if abs(normal[2]) < STEEP else [1.0, 0.0, 0.0])
    up = reference - (reference @ normal) * normal
    up /= np.linalg.norm(up)
    return np.stack([-np.asarray(normal, dtype=float), np.cross(up, normal), up])


def push_of(contact: SurfacePoint, force: Floats) -> Push:
    """The push with a force (3,) N at a contact: the inverse of `Push.force`."""
    strength = float(np.linalg.norm(force))
    if strength == 0.0:
        return Push(contact, 0.0)
    inward, side, up = contact_axes(contact.normal) @ (np.asarray(force, dtype=float) / strength)
    across = math.hypot(side, up)
    angle = math.atan2(across, inward)
    scale = angle / across if across > 1e-12 else 0.0
    return Push(contact, strength, float(scale * up), float(scale * side))


def default_contact(mesh: Mesh, towards: Floats = TOWARDS) -> SurfacePoint:
    """A point in the open whose normal is near `towards` (3,), where the sphere fits.

    If it fits nowhere that was tried, the point is the best of all.
    """
    points = np.asarray(mesh.points, dtype=float)
    direction = np.asarray(towards, dtype=float) / np.linalg.norm(towards)
    size = float(np.ptp(points, axis=0).max())
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    third = np.full(3, 1.0 / 3.0)
    chosen = range(0, len(mesh.faces), max(len(mesh.faces) // CANDIDATES, 1))
    corners = points[mesh.faces[chosen]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    away = corners.mean(axis=1) - middle
    aside = np.linalg.norm(away - (away @ direction)[:, None] * direction, axis=1) / size
    order = np.argsort(FAR * (aside - away @ direction / size) - normals @ direction)
    found = (surface_point(mesh, chosen[index], third) for index in order)
    first = surface_point(mesh, chosen[order[0]], third)
    return next((contact for contact in found if touching_centre(mesh, contact) is not None), first)
