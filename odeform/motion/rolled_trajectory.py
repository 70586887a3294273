"""A motion whose deformation is known in axes that do not roll with the body."""

import numpy as np
from jaxtyping import Float

from odeform.motion.changed_trajectory import ChangedTrajectory
from odeform.motion.reduced_motion import Trajectory
from odeform.motion.reduced_space import ReducedSpace
from odeform.types import Times

__all__ = ["RolledTrajectory"]


class RolledTrajectory(ChangedTrajectory):
    """The same motion in modes of the body, which turn with it."""

    def __init__(self, own: Trajectory, space: ReducedSpace) -> None:
        super().__init__(own)
        self._space = space

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """(T,) s -> (T, 6 + K)."""
        return self._space.with_modes(self.own.reduced(times))
