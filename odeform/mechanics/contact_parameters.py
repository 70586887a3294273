"""Holds what is learned of contact and material: few numbers, the same for all bodies."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass

__all__ = ["ContactParameters"]

KEYS = {"static_penetration": "sink", "floor_regularisation": "floor_grip", "push_regularisation": "push_grip"}
"""Names of fields in files, where they differ."""


@dataclass(frozen=True)
class ContactParameters:
    """Contact and material of reduced mechanics.

    Fits to training motions start from these values, which an earlier fit found.
    """

    static_penetration: float = 6.2e-05
    """Metres by which a body at rest stands in the floor: the floor's stiffness, relative to the body's weight."""
    floor_damping: float = 3.8e-3
    """Seconds; the floor pushes as if the body were deeper by this times its speed. So it begins just above the floor,
    and the force is a continuous function of the state."""
    floor_friction: float = 0.45
    """Coulomb coefficient."""
    floor_regularisation: float = 2.7e3
    """1/s: regularises friction of slow sliding, by its speed and by the mass that stands on the contact."""
    push_stiffness: float = 4.5e5
    """1/s^2: force of the projectile by the overlap and by the mass behind the contact."""
    push_damping: float = 6e-3
    """Seconds, as for the floor."""
    push_friction: float = 0.4
    """Coulomb coefficient."""
    push_regularisation: float = 7.5e3
    """1/s, as for the floor."""
    stiffness: float = 0.95
    """Factor on the squared frequencies of the modes."""
    damping: float = 1.15
    """Factor on the damping of the modes."""

    @classmethod
    def from_json(cls, data: Mapping[str, float]) -> "ContactParameters":
        """The inverse of `to_json`; `TypeError` or `ValueError` for what is missing, unknown, or no number."""
        names = {key: name for name, key in KEYS.items()}
        return cls(**{names.get(key, key): float(value) for key, value in data.items()})

    def to_json(self) -> dict[str, float]:
        """Names and values as files have them."""
        return {KEYS.get(name, name): value for name, value in asdict(self).items()}
