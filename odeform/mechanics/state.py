"""The state of reduced mechanics, for a batch of B motions of one body."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.mechanics.rotations import turn, turned
from odeform.types import Floats

__all__ = ["State", "apart", "extrapolated"]


@dataclass(frozen=True, eq=False)
class State:
    """Positions and velocities, in axes of the scene; modal amplitudes in those of the body.

    The first 6 + K velocities are those of the body: of its mass centre, its spin in rad/s, and of its modes. While a
    projectile pushes, the last is its speed along its guide.
    """

    shift: Float[np.ndarray, "*batch 3"]
    """m, of the mass centre from rest."""
    rotation: Float[np.ndarray, "*batch 3 3"]
    modes: Float[np.ndarray, "*batch modes"]
    """root kg m."""
    projectile: Float[np.ndarray, "*batch 1"]
    """m, how far the projectile has moved along its guide."""
    velocity: Float[np.ndarray, "*batch velocities"]

    @property
    def body(self) -> int:
        """Number of velocities of the body, 6 + K; that of the projectile follows."""
        return 6 + self.modes.shape[-1]

    @property
    def pushed(self) -> bool:
        """Whether the projectiles are there."""
        return self.velocity.shape[-1] > self.body

    def moved(self, velocity: Float[np.ndarray, "steps batch velocities"], step: Floats) -> "State":
        """After each of H steps (H, 1, 1) in s with a constant new velocity: a batch (H, B)."""
        way, count = step * velocity, self.body
        return State(
            self.shift + way[..., :3],
            turned(self.rotation, way[..., 3:6]),
            self.modes + way[..., 6:count],
            self.projectile + way[..., count:] if self.pushed else np.broadcast_to(self.projectile, way[..., :1].shape),
            velocity,
        )

    def after(self, index: int) -> "State":
        """One of the steps of `moved`: a batch of B."""
        return State(
            self.shift[index], self.rotation[index], self.modes[index], self.projectile[index], self.velocity[index]
        )

    def without_projectile(self) -> "State":
        """Returns the same, after the projectile is gone."""
        return State(self.shift, self.rotation, self.modes, self.projectile, self.velocity[:, : self.body])


def apart(one: State, other: State) -> Float[np.ndarray, "batch coordinates"]:
    """Computes (B, 6 + K) from the other to the one: shift in m, rotation vector in rad, and modal amplitudes."""
    turns = turn(one.rotation @ other.rotation.transpose(0, 2, 1))
    return np.concatenate([one.shift - other.shift, turns, one.modes - other.modes], axis=1)


def extrapolated(coarse: State, fine: State, between: Float[np.ndarray, "batch coordinates"]) -> State:
    """Twice `fine` minus `coarse`, which are `apart` by `between`: second order from one step and two half steps of
    first order (Richardson)."""
    return State(
        fine.shift + between[:, :3],
        turned(fine.rotation, between[:, 3:6]),
        fine.modes + between[:, 6:],
        2.0 * fine.projectile - coarse.projectile,
        2.0 * fine.velocity - coarse.velocity,
    )
