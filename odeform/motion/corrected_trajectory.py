"""A motion that is solved for, with its correction."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from odeform.motion.changed_trajectory import ChangedTrajectory
from odeform.motion.reduced_motion import Trajectory
from odeform.types import Floats, Times

__all__ = ["CorrectedTrajectory"]


class CorrectedTrajectory(ChangedTrajectory):
    """Within the trained window y = kept * own + rest. Beyond it, what that adds to the own motion stays as it is
    at the end: the motion there is its own."""

    def __init__(
        self,
        own: Trajectory,
        kept: Float[np.ndarray, " y"],
        rest: Callable[[Floats], Float[np.ndarray, "times y"]],
        stop: float,
    ) -> None:
        """`own` is what is solved for, of which the factors `kept` (6 + K,) and `rest` are those of its correction,
        which ends at `stop` seconds."""
        super().__init__(own)
        self._taken, self._rest, self._stop = 1.0 - kept, rest, stop

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """(T,) s -> (T, 6 + K), zero at time 0."""
        own, inside = self.own.reduced(times), np.minimum(times, self._stop)
        added = self._rest(inside)
        if self._taken.any():
            added -= self._taken * (own if (times <= self._stop).all() else self.own.reduced(inside))
        return own + added * (times > 0.0)[:, None]
