"""What a shell is made of."""

from dataclasses import dataclass

__all__ = ["Material", "wall_thickness"]


@dataclass(frozen=True)
class Material:
    """A shell's material and its contact, SI units."""

    young: float  # Pa
    poisson: float
    damping: float  # s, stiffness-proportional
    friction: float  # Coulomb coefficient against the floor
    contact_time: float  # s, MuJoCo's solref time constant


def wall_thickness(bending: float, material: Material) -> float:
    """Thickness h in metres of a wall of bending stiffness EI = E h^3 / (12 (1 - nu^2)), in N m."""
    return (12.0 * (1.0 - material.poisson**2) * bending / material.young) ** (1.0 / 3.0)
