"""Materials of shells."""

from dataclasses import dataclass

__all__ = ["Material", "damping_time", "wall_thickness"]


@dataclass(frozen=True)
class Material:
    """A shell's material and its contact, SI units."""

    young: float  # Pa
    poisson: float
    viscosity: float  # N s/m, of the wall against stretching, for any thickness
    friction: float  # Coulomb coefficient against the floor
    contact_time: float  # s, MuJoCo's solref time constant


def wall_thickness(bending: float, material: Material) -> float:
    """Returns the thickness h in metres of a wall of bending stiffness EI = E h^3 / (12 (1 - nu^2)), in N m."""
    return (12.0 * (1.0 - material.poisson**2) * bending / material.young) ** (1.0 / 3.0)


def damping_time(thickness: float, material: Material) -> float:
    """Returns the ratio of damping to stiffness in seconds of a wall of `thickness` metres: viscosity / (E h).

    Energy is lost in a lining that is the same for all walls. If damping were a fixed fraction of the stiffness, every
    force would be proportional to mass or to stiffness, and only their ratio could be recovered from a motion.
    """
    return material.viscosity / (material.young * thickness)
