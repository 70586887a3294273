"""Describes what acts on a body: a floor, gravity, a sphere that pushes. Data sets and checkpoints keep it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

__all__ = ["Contacts", "Surroundings"]

GRAVITY = 9.81  # m/s^2


@dataclass(frozen=True)
class Contacts:
    """A rigid sphere that pushes a body: how strongly, for how long, and how large it is."""

    forces: Mapping[str, tuple[float, float]]
    """Weakest and strongest force on each object in newton."""
    pulse: float
    """Seconds from 0 on during which the sphere pushes."""
    radius: float
    """Radius of the sphere in metres."""

    def forces_on(self, name: str) -> tuple[float, float]:
        """Returns the weakest and strongest force on an object in newton; those of the first for an unknown one."""
        return self.forces.get(name) or next(iter(self.forces.values()))

    def stronger(self, name: str, strength: float) -> float:
        """By how much a push of `strength` newton is stronger than all on that object, in halves of the strongest."""
        return max(strength / self.forces_on(name)[1] - 1.0, 0.0) / 0.5


@dataclass(frozen=True)
class Surroundings:
    """The surroundings of all motions of a scene.

    Examples:
        >>> import odeform
        >>> odeform.Surroundings(floor=-0.2).gravity  # m/s^2
        9.81
    """

    floor: float | None = 0.0
    """Height in metres of the floor, which no motion may pass; None without one."""
    gravity: float = GRAVITY
    """m/s^2, along -z."""
    contacts: Contacts | None = None
    """The sphere, in scenes in which one pushes a body."""

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "Surroundings":
        """The inverse of `dataclasses.asdict`; KeyError, TypeError or ValueError for what is missing or wrong."""
        floor, contacts = data["floor"], data.get("contacts")
        if contacts is not None:
            forces = {str(name): (float(low), float(high)) for name, (low, high) in contacts["forces"].items()}
            contacts = Contacts(forces, float(contacts["pulse"]), float(contacts["radius"]))
            numbers = [contacts.pulse, contacts.radius, *(force for pair in forces.values() for force in pair)]
            if not forces or not all(0.0 <= number < math.inf for number in numbers):
                raise ValueError(f"contacts: expected finite numbers of 0 or more, got {dict(data['contacts'])}")
        found = cls(None if floor is None else float(floor), float(data["gravity"]), contacts)
        if not math.isfinite(found.gravity) or not math.isfinite(found.floor or 0.0):
            raise ValueError(f"surroundings: expected finite numbers, got {dict(data)}")
        return found
