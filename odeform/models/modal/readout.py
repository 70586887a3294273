"""From states of the mechanics to the coordinates of a motion."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.mechanics.flat import body_motion
from odeform.models.modal.coordinates import Coordinates
from odeform.models.modal.release import released
from odeform.models.modal.settled import SettledBody
from odeform.motion.reduced_space import POSE
from odeform.types import Floats, Times

__all__ = ["Readout"]


@dataclass(frozen=True, eq=False)
class Readout:
    """Maps states of the mechanics to coordinates of a motion."""

    coordinates: Coordinates
    settled: SettledBody | None
    scale: float
    """Scales amplitudes: modes of a heavier body move less by each unit."""

    def __call__(self, times: Times, states: Floats) -> Floats:
        """(T,) s and states (T, 20 + 2 K) -> (T, 6 + K)."""
        shift, rotation, modes = body_motion(states)
        y = self.coordinates.reduced(shift, rotation, self.scale * modes)
        return y if self.settled is None else self.settled.relative(y)

    def poses(self, states: Floats) -> Float[np.ndarray, "times 6"]:
        """The first (T, 6) coordinates of states (T, 20 + 2 K), without the deformation, which takes longest."""
        shift, rotation, modes = body_motion(states)
        y = self.coordinates.pose(shift, rotation, self.scale * modes)
        return y if self.settled is None else self.settled.relative_pose(y)

    def released(self, states: Float[np.ndarray, "3 state"], y: Float[np.ndarray, "3 y"]) -> Floats:
        """Returns the state (20 + 2 K,) from which a body goes on, see `odeform.models.modal.release.released`.

        `states` (3, 20 + 2 K) and coordinates `y` (3, 6 + K) are at the times `before`.
        """
        pose = y[:, :POSE] if self.settled is None else self.settled.absolute(y[:, :POSE])
        return released(self.coordinates, states, pose, self.scale)
