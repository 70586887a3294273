"""Makes the inputs of a regression on a push at a point: contact, normal, force and torque, in several frames."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.geometry.normals import nearest_normals
from odeform.motion.reduced_space import ReducedSpace
from odeform.schema import Schema
from odeform.types import Floats, Rotations

__all__ = ["FRAMES", "ContactInputs", "contact_inputs", "has_contact"]

FRAMES = ("body", "azimuth", "normal")
"""Axes of the body; turned about the vertical axis to the contact's normal; the normal and a horizontal tangent."""
UP = np.array([0.0, 0.0, 1.0])
ACROSS_UP = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
"""v -> UP x v, for rows."""
VECTORS = ("contact", "force")
STEEP = 1e-6  # length of a horizontal part that gives no direction

Rows = Float[np.ndarray, "sequences 3"]


def has_contact(schema: Schema) -> bool:
    """Whether motions are caused by a force at a contact: parameters contact_x to force_z."""
    names = {p.name for p in schema.learned}
    return {f"{vector}_{axis}" for vector in VECTORS for axis in "xyz"} <= names


@dataclass(frozen=True, eq=False)
class ContactInputs:
    """S contacts relative to the body's centre of mass (m), their outward unit normals, and forces (N)."""

    contact: Rows
    normal: Rows
    force: Rows

    @cached_property
    def _in_frames(self) -> dict[str, tuple[Rotations, list[Floats], Rows]]:
        """Rotations and features in the frames asked for so far: several regressions ask for the same."""
        return {}

    @cached_property
    def _torque(self) -> Rows:
        return np.cross(self.contact, self.force)

    def frames(self, frame: str) -> Rotations:
        """Computes (S, 3, 3) rotations from the axes of the body to those of one of `FRAMES`."""
        return self._in(frame)[0]

    def features(self, frame: str) -> tuple[list[Floats], Rows]:
        """Returns the groups of inputs (S, n), and the force (S, 3) in that frame.

        In the body's own axes these are contact and force alone, else contact, normal, force, its part along the normal
        and its torque about the centre of mass.
        """
        return self._in(frame)[1:]

    def _in(self, frame: str) -> tuple[Rotations, list[Floats], Rows]:
        if frame not in self._in_frames:
            turn = self._turns(frame)
            self._in_frames[frame] = (turn, *self._features(frame, turn))
        return self._in_frames[frame]

    def _turns(self, frame: str) -> Rotations:
        if frame == "body":
            return np.broadcast_to(np.eye(3), (len(self.contact), 3, 3))
        if frame == "azimuth":
            along = _unit(self.normal * (1.0 - UP), np.array([1.0, 0.0, 0.0]))
            return np.stack([along, along @ ACROSS_UP, np.broadcast_to(UP, along.shape)], axis=1)
        across = _unit(self.normal @ ACROSS_UP, np.array([0.0, 1.0, 0.0]))
        return np.stack([self.normal, across, np.cross(self.normal, across)], axis=1)

    def _features(self, frame: str, turn: Rotations) -> tuple[list[Floats], Rows]:
        if frame == "body":
            return [self.contact, self.force], self.force
        force = np.einsum("sij,sj->si", turn, self.force)
        torque = np.einsum("sij,sj->si", turn, self._torque)
        inward = (self.force * self.normal).sum(axis=1, keepdims=True)
        return [self.contact, self.normal, force, inward, torque], force


def contact_inputs(
    schema: Schema, theta: Float[np.ndarray, "sequences parameters"], space: ReducedSpace
) -> ContactInputs:
    """Makes the inputs from normalised parameters (S, P) and the space of a body that rests in the scene.

    Raises `InputError` for a body of which no surface is known: its contacts have no normal.
    """
    if space.surface is None:
        raise InputError("gp: expected a body with faces, whose contacts have normals")
    values = {p.name: np.array([p.denormalise(float(u)) for u in theta[:, i]]) for i, p in enumerate(schema.learned)}
    contact, force = (np.stack([values[f"{vector}_{axis}"] for axis in "xyz"], axis=1) for vector in VECTORS)
    contact = contact - space.anchor
    return ContactInputs(contact, nearest_normals(space.surface, contact), force)


def _unit(vectors: Rows, fallback: Floats) -> Rows:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(size > STEEP, vectors / np.maximum(size, STEEP), fallback)
