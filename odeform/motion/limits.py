"""Bounds what a motion of a body in a scene can do."""

from dataclasses import dataclass

__all__ = ["DEPTH", "Limits"]

DEPTH = 5e-3
"""Metres that a body may sink into the floor. The simulator's contacts let it sink by up to 3 mm."""


@dataclass(frozen=True)
class Limits:
    """Bounds of physically possible motions.

    Attributes:
        floor: Height of the floor in metres; None where nothing is known of a floor.
        depth: Metres that a body may sink into it.
        gravity: m/s^2, along -z.
        deformation: Largest RMS deformation, in multiples of the largest trained one. Inside the trained box models
            reach 1.0, and up to ten times beyond it 1.2; a continuation that gets lost passes 1.4.
        energy: Largest energy of the rigid motion after the trained window, in multiples of the largest within it.
            Nothing drives a body then: sound motions stay below 0.6, one that falls through the floor reaches 18.
        ends: Whether a motion ends where it is first not valid after the trained window, because what follows builds on
            it. Mechanics loses energy by itself and gets up again: then each moment is checked as in the window, and
            where a body deforms more than it can, its deformation is bounded and its rigid motion goes on.
        flat: Whether what is in the floor or an obstacle is shown flat on it (`odeform.motion.ground`): then a motion
            that does not end goes on there, too.
    """

    floor: float | None = None
    depth: float = DEPTH
    gravity: float = 9.81
    deformation: float = 1.3
    energy: float = 1.1
    ends: bool = True
    flat: bool = False
