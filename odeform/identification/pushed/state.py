"""Holds what is unknown of a pushed body: how it is made, where and how it was pushed, and where the camera stood."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.geometry.contact import checked_contact, nearest_on
from odeform.geometry.rigid import rotation_from_vector
from odeform.schema import Parameter
from odeform.types import Floats, Mesh, Points, Rotations, Vector

__all__ = ["BODY", "BODY_STEP", "FRICTION", "POSE", "PUSH_NAMES", "PUSH_STEPS", "Camera", "PushState", "body_steps"]

FRICTION = "friction"
BODY = ("mass", "young", FRICTION)
"""Names of what is unknown of the body itself, in this order."""
BODY_STEP = 0.05
"""Of differences, in halves of the ranges of `BODY`."""
PUSH_STEPS = 5
"""Unknowns of a push: two of the contact's place on the surface, three of the force."""
PUSH_NAMES = tuple(f"{kind}_{axis}" for kind in ("contact", "force") for axis in "xyz")
"""Parameters of a push."""
POSE = 6
"""Unknowns of a camera."""


@dataclass(frozen=True, eq=False)
class Camera:
    """Maps points as they were observed to the scene: `rotation` x + `shift`, in metres."""

    rotation: Rotations = field(default_factory=lambda: np.eye(3))
    shift: Vector = field(default_factory=lambda: np.zeros(3))

    def points(self, observed: Points) -> Points:
        """Returns (N, 3) m in the scene."""
        return observed @ self.rotation.T + self.shift

    def moved(self, step: Float[np.ndarray, " 6"], about: Vector) -> "Camera":
        """Returns the camera after a turn by `step[3:]` rad about `about` (3,) m and a shift by `step[:3]` m."""
        turn = rotation_from_vector(step[3:])
        return Camera(turn @ self.rotation, turn @ (self.shift - about) + about + step[:3])


@dataclass(frozen=True, eq=False)
class PushState:
    """One guess of everything that is unknown.

    Steps from it are vectors: of `BODY`, in halves of their ranges; of the contact along two `tangents`, in `size` m;
    and of the force, in `strongest` N.
    """

    rest: Mesh
    """The body at rest as it was measured, on which contacts are places."""
    ranges: tuple[Parameter, ...]
    """Of `BODY`."""
    strongest: float
    """N"""
    body: Float[np.ndarray, " 3"]
    """`BODY` in [-1, 1]."""
    contact: Vector
    """(3,) m on `rest`."""
    force: Vector
    """(3,) N."""
    camera: Camera = field(default_factory=Camera)

    @property
    def size(self) -> float:
        """Metres: half of the body's largest extent."""
        return 0.5 * float(np.ptp(self.rest.points, axis=0).max())

    @cached_property
    def tangents(self) -> Float[np.ndarray, "2 3"]:
        """Unit vectors along the surface at the contact."""
        normal = nearest_on(self.rest, self.contact).normal
        side = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
        side /= np.linalg.norm(side)
        return np.stack([side, np.cross(normal, side)])

    def value(self, name: str) -> float:
        """One of `BODY` in its own unit."""
        index = BODY.index(name)
        return self.ranges[index].denormalise(float(self.body[index]))

    def parameters(self) -> dict[str, float]:
        """The parameters of the scene."""
        pairs = (("contact", self.contact), ("force", self.force))
        push = {f"{key}_{axis}": float(x) for key, vector in pairs for axis, x in zip("xyz", vector, strict=True)}
        return {**push, "mass": self.value("mass"), "young": self.value("young")}

    @property
    def vector(self) -> Float[np.ndarray, " 9"]:
        """`body`, the place of the contact in `size` m, and the force in `strongest` N: how far states are apart."""
        return np.concatenate([self.body, self.contact / self.size, self.force / self.strongest])

    def stepped(self, step: Floats) -> "PushState":
        """Returns the state after a step (8,), `BODY` kept in its ranges. `InputError` where no sphere can push."""
        body = np.clip(self.body + step[: len(BODY)], -1.0, 1.0)
        if not step[len(BODY) :].any():
            return replace(self, body=body)
        along = self.size * step[len(BODY) : len(BODY) + 2] @ self.tangents
        force = self.force + self.strongest * step[len(BODY) + 2 :]
        contact = nearest_on(self.rest, self.contact + along).point if along.any() else self.contact
        checked_contact(self.rest, contact, force)
        if not force.any():
            raise InputError("force: expected one that is not zero")
        return replace(self, body=body, contact=contact, force=force)


def body_steps(body: Float[np.ndarray, " 3"], free: Sequence[int] = range(len(BODY))) -> Float[np.ndarray, "free 3"]:
    """(F, 3): a step from a body for each of those of `BODY` that are `free`, within the ranges.

    Mass and stiffness scaled alike move a body nearly alike, and under no other force than its weight exactly so. One
    step is therefore along both: with one along each, what is curved in their differences would look like information
    about their common scale.
    """
    steps = np.zeros((len(free), len(BODY)))
    for row, index in zip(steps, free, strict=True):
        both = [0, 1] if index == 1 and 0 in free and np.ptp(body[:2]) < 2.0 - 2.0 * BODY_STEP else [index]
        row[both] = -BODY_STEP if body[both].max() + BODY_STEP > 1.0 else BODY_STEP
    return steps
