"""The state of reduced mechanics, for a batch of B motions of one body."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.mechanics.turns import turn, turned
from odeform.types import Floats

__all__ = ["State", "extrapolated"]


@dataclass(frozen=True, eq=False)
class State:
    """Positions and velocities, in axes of the scene; modal amplitudes in those of the body.

    The first 6 + K velocities are those of the body: of its mass centre, its spin in rad/s, and of its modes. While a
    projectile pushes, the last is its speed along its guide.
    """

    shift: Float[np.ndarray, "batch 3"]
    """m, of the mass centre from rest."""
    rotation: Float[np.ndarray, "batch 3 3"]
    modes: Float[np.ndarray, "batch modes"]
    """root kg m."""
    projectile: Float[np.ndarray, "batch 1"]
    """m, how far the projectile has moved along its guide."""
    velocity: Float[np.ndarray, "batch velocities"]

    @property
    def body(self) -> int:
        """Number of velocities of the body, 6 + K; that of the projectile follows."""
        return 6 + self.modes.shape[1]

    @property
    def pushed(self) -> bool:
        """Whether the projectiles are there."""
        return self.velocity.shape[1] > self.body

    def moved(self, velocity: Floats, step: Float[np.ndarray, "batch 1"]) -> "State":
        """After `step` seconds (B, 1) with a constant new velocity (B, V)."""
        way, count = step * velocity, self.body
        return State(
            self.shift + way[:, :3],
            turned(self.rotation, way[:, 3:6]),
            self.modes + way[:, 6:count],
            self.projectile + way[:, count:] if self.pushed else self.projectile,
            velocity,
        )

    def without_projectile(self) -> "State":
        """The same, after the projectile is gone."""
        return State(self.shift, self.rotation, self.modes, self.projectile, self.velocity[:, : self.body])

    def twice(self) -> "State":
        """A batch of 2 B: these motions, and the same again."""
        return State(*(np.concatenate([part, part]) for part in self._parts))

    def halves(self) -> tuple["State", "State"]:
        """The first and the second half of a batch."""
        count = len(self.shift) // 2
        return State(*(part[:count] for part in self._parts)), State(*(part[count:] for part in self._parts))

    @property
    def _parts(self) -> tuple[Floats, ...]:
        return self.shift, self.rotation, self.modes, self.projectile, self.velocity


def extrapolated(coarse: State, fine: State) -> State:
    """Twice `fine` minus `coarse`: second order from one step and two half steps of first order (Richardson)."""
    return State(
        2.0 * fine.shift - coarse.shift,
        turned(fine.rotation, turn(fine.rotation @ coarse.rotation.transpose(0, 2, 1))),
        2.0 * fine.modes - coarse.modes,
        2.0 * fine.projectile - coarse.projectile,
        2.0 * fine.velocity - coarse.velocity,
    )
