"""The sphere that pushes a body: where it touches, where it is, and its force as an arrow. Knows no GUI."""

import math
from dataclasses import dataclass
from functools import cached_property
from html import escape

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from odeform.geometry.contact import CONE, projectile_centre, touching_centre
from odeform.geometry.push import Push
from odeform.geometry.rays import first_on_mesh, first_on_points
from odeform.loads.registry import load_of_scene
from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.schema import OBJECT, Parameters, Schema
from odeform.simulation.contacts import push_from
from odeform.simulation.scenes.registry import find_scene, surroundings_of
from odeform.surroundings import Contacts
from odeform.types import Floats, Geometry, Mesh, Points, Vector
from odeform_viz.columns import Column
from odeform_viz.view import ColumnFrame, Frame

__all__ = [
    "ShownPush",
    "acting_times",
    "contacts_of",
    "describe_push",
    "first_push",
    "outside_of_push",
    "picked",
    "push_excess",
    "push_shown",
    "surface_of",
]

NEIGHBOURS = 3  # points of a shape that carry a contact
LENGTH = 0.5  # of the body's size: the arrow of its strongest force
LONGEST = 2.0  # times that, at most
LEAST = 0.12  # m; the size of a smaller body, for its arrow
PICK = 0.02  # of a shape's size: how far from a ray its points may be


def contacts_of(schema: Schema) -> Contacts | None:
    """How a sphere pushes the bodies of a scene; None in scenes without one."""
    surroundings = surroundings_of(schema) if schema.objects else None
    return surroundings.contacts if surroundings else None


def surface_of(column: Column, parameters: Parameters) -> Mesh:
    """The body at rest on whose surface contacts lie."""
    return column.predictor.rest_of(parameters) if column.predictor else column.source.geometry  # pyright: ignore


@dataclass(frozen=True, eq=False)
class ShownPush:
    """A push on the shape of one column."""

    push: Push
    contacts: Contacts
    surface: Mesh
    strongest: float
    """N: the strongest force in training."""
    carriers: Int[np.ndarray, " carriers"]
    """The points of the shape that carry the contact, which is at the sum of their positions times `weights`."""
    weights: Float[np.ndarray, " carriers"]
    offset: Vector
    """(3,) m, added to that sum."""

    @cached_property
    def centre(self) -> Vector:
        """(3,) m: that of the sphere at time 0; the contact of a force that acts without one."""
        contact = self.push.contact
        if self.contacts.radius == 0.0:
            return contact.point
        fitting = touching_centre(self.surface, contact)
        return contact.point + self.contacts.radius * contact.normal if fitting is None else fitting

    @property
    def size(self) -> float:
        """Metres: that of the body, for what is drawn beside it."""
        return max(float(np.ptp(self.surface.points, axis=0).max()), LEAST)

    @property
    def unit(self) -> float:
        """Metres of the arrow for one newton."""
        return LENGTH * self.size / self.strongest

    @property
    def arrow(self) -> tuple[Vector, Vector]:
        """Tail and head (3,) m at time 0: the arrow ends at the sphere."""
        direction = self.push.direction
        head = self.centre - self.contacts.radius * direction
        return head - min(self.unit * self.push.strength, LONGEST * LENGTH * self.size) * direction, head

    def pulled_to(self, tail: Floats) -> Vector:
        """(3,) N: the force whose arrow starts at `tail` (3,) m; none if that is inside of the sphere."""
        away = self.centre - np.asarray(tail, dtype=float)
        distance = float(np.linalg.norm(away))
        length = distance - self.contacts.radius
        return np.zeros(3) if length <= 0.0 else length / self.unit * away / distance

    def contact(self, points: Points) -> Vector:
        """(3,) m: the contact on the shape once its points are at (N, 3) m."""
        return self.weights @ np.asarray(points[self.carriers], dtype=float) + self.offset

    def shift(self, moved: Floats) -> Vector:
        """(3,) m: how far the sphere has moved once the contact is at `moved` (3,) m."""
        return projectile_centre(self.push.contact, self.centre, self.push.force, moved) - self.centre

    def acts(self, time: float) -> bool:
        """Whether the sphere pushes at `time` s."""
        return 0.0 <= time <= self.contacts.pulse + 1e-9


def push_shown(column: Column, motion: Motion | RecordedMotion) -> ShownPush | None:
    """The push that a motion answers; None in scenes without one."""
    contacts = contacts_of(motion.schema)
    if contacts is None:
        return None
    surface, parameters = surface_of(column, motion.parameters), motion.parameters
    push = push_from(parameters, surface)
    points, contact = np.asarray(motion.geometry.points, dtype=float), push.contact
    name = str(parameters[OBJECT])
    if isinstance(motion.geometry, Mesh) and np.array_equal(motion.geometry.faces, surface.faces):
        carriers, weights = np.asarray(surface.faces[contact.face]), contact.barycentric
    else:
        count = min(NEIGHBOURS, len(points))
        carriers = np.atleast_1d(KDTree(points).query(contact.point, count)[1])
        weights = np.full(count, 1.0 / count)
    strongest = column.predictor.force_range({OBJECT: name})[1] if column.predictor else contacts.forces_on(name)[1]
    # a place on the body moves with it when it sags; a loaded shape is only about where the body is
    offset = np.zeros(3) if len(carriers) == len(contact.barycentric) and weights is contact.barycentric else None
    offset = contact.point - weights @ points[carriers] if offset is None else offset
    return ShownPush(push, contacts, surface, strongest, carriers, weights, offset)


def acting_times(shown: ColumnFrame) -> list[tuple[float, float]]:
    """From when to when, in s, something acts on a body: a sphere, or what the scene draws as arrows."""
    if (contacts := contacts_of(shown.motion.schema)) is not None:
        return [(0.0, contacts.pulse)]
    if (load := load_of_scene(shown.motion.schema.scene)) is not None and load.flies:
        return []  # its arrow is a velocity
    scene = find_scene(shown.motion.schema.scene)
    if scene is None:
        return []
    rest = np.asarray(shown.column.geometry.points, dtype=np.float32)
    return [(arrow.begin, arrow.end) for arrow in scene.glyphs(shown.motion.parameters, rest)]


def picked(geometry: Geometry, shown: Points, origin: Floats, direction: Floats) -> tuple[Vector, float] | None:
    """The point of a shape at rest (3,) m that a ray meets while its points are at `shown` (N, 3) m.

    The second value is the distance in lengths of `direction` (3,); None if the ray passes beside the shape.
    """
    if isinstance(geometry, Mesh):
        hit = first_on_mesh(origin, direction, shown, geometry.faces)
        if hit is None:
            return None
        face, weights, distance = hit
        return weights @ np.asarray(geometry.points, dtype=float)[geometry.faces[face]], distance
    found = first_on_points(origin, direction, shown, PICK * float(np.ptp(shown, axis=0).max()))
    return None if found is None else (np.asarray(geometry.points[found[0]], dtype=float), found[1])


def push_excess(push: Push, forces: tuple[float, float], known: str = "trained") -> dict[str, str]:
    """Says in words in what a push is beyond those that are `known`, "trained" or "measured", and how far these go."""
    excess = {}
    if push.strength > forces[1] * (1.0 + 1e-6):
        excess["force"] = f"{known} up to {forces[1]:.3g} N"
    if push.strength > 0.0 and push.steep:
        excess["direction"] = f"{known} up to {math.degrees(CONE):.0f}° from straight in"
    return excess


def describe_push(push: Push, name: str) -> str:
    """One line of HTML: the force, and where it acts on the object called `name`."""
    upward, height = push.contact.normal[2], 1e3 * push.contact.point[2]
    where = "upper side" if upward > 0.5 else "underside" if upward < -0.5 else "side"
    place = f"the {escape(name)}'s {where}, {height:.0f} mm above the floor"
    if push.strength == 0.0:
        return f"<b>no force</b> on {place}: nothing moves"
    angle = math.degrees(push.angle)
    tilt = "straight into the surface" if angle < 0.5 else f"{angle:.0f}° from straight in"
    return f"<b>{push.strength:.3g} N</b> on {place}, {tilt}"


def first_push(frame: Frame) -> tuple[Push, str] | None:
    """The push of the first visible model, and the name of what it pushes; None in scenes without one."""
    shown = _first_model(frame)
    if shown is None or contacts_of(shown.motion.schema) is None:
        return None
    parameters = shown.motion.parameters
    name = "shape" if shown.column.loaded else str(parameters[OBJECT])
    return push_from(parameters, surface_of(shown.column, parameters)), name


def outside_of_push(frame: Frame) -> list[str]:
    """Says what of the first visible model's push is outside of its training; empty in scenes without one."""
    shown, found = _first_model(frame), first_push(frame)
    if shown is None or shown.column.predictor is None or found is None:
        return []
    return list(push_excess(found[0], shown.column.predictor.force_range(shown.motion.parameters)))


def _first_model(frame: Frame) -> ColumnFrame | None:
    return next((c for c in frame.columns if c.column.predictor), None)
