"""What is learned of contact and material: few numbers, the same for all bodies."""

from dataclasses import dataclass

__all__ = ["ContactParameters"]


@dataclass(frozen=True)
class ContactParameters:
    """Contact and material of reduced mechanics.

    Fits to training motions start from these values, which an earlier fit found.
    """

    sink: float = 6.2e-05
    """Metres by which a body at rest sinks into the floor: the floor's stiffness, relative to the body's weight."""
    floor_damping: float = 3.8e-3
    """Seconds; the floor pushes as if the body were deeper by this times its speed. So it begins just above the floor,
    and the force is a continuous function of the state."""
    floor_friction: float = 0.45
    """Coulomb coefficient."""
    floor_grip: float = 2.7e3
    """1/s: friction of slow sliding, by its speed and by the mass that stands on the contact."""
    push_stiffness: float = 4.5e5
    """1/s^2: force of the projectile by the overlap and by the mass behind the contact."""
    push_damping: float = 6e-3
    """Seconds, as for the floor."""
    push_friction: float = 0.4
    """Coulomb coefficient."""
    push_grip: float = 7.5e3
    """1/s, as for the floor."""
    stiffness: float = 0.95
    """Factor on the squared frequencies of the modes."""
    damping: float = 1.15
    """Factor on the damping of the modes."""
