"""Keeps a motion out of the floor."""

from collections.abc import Callable
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.motion.changed_trajectory import ChangedTrajectory
from odeform.motion.reduced_motion import Trajectory
from odeform.types import Floats, Times

__all__ = ["LiftedTrajectory", "floor_lift"]

MOST = 0.01  # m; a motion that would have to be lifted farther is lost, and is left to the watch


class LiftedTrajectory(ChangedTrajectory):
    """Lifts a body where its motion takes it deeper into the floor than it may be.

    Springs of the floor stand for the compression of what rests on it, so a leg under load sinks. Where that is more
    than the floor allows, the rest of the motion is nevertheless right: the body is lifted by what is too much.
    """

    def __init__(
        self,
        own: Trajectory,
        lowest: Callable[[Floats], Floats],
        limit: float,
        grid: Float[np.ndarray, " grid"] | None = None,
    ) -> None:
        """`lowest` maps coordinates (T, 6 + K) to the height of the lowest point (T,) in m, which may be `limit`.

        With `grid`, in s, the lift is linear between these times, and stays as it is after them.
        """
        super().__init__(own)
        self._lowest, self._limit, self._grid = lowest, limit, grid

    @cached_property
    def _lift(self) -> Floats:
        """(G,) m at the times of the grid."""
        assert self._grid is not None
        return self._by(self.own.reduced(self._grid))

    def _by(self, y: Floats) -> Floats:
        """(T,) m by which coordinates (T, 6 + K) are lifted."""
        return floor_lift(self._lowest(y), self._limit)

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """(T,) s -> (T, 6 + K)."""
        y = self.own.reduced(times)
        lift = self._by(y) if self._grid is None else np.interp(times, self._grid, self._lift)
        if lift.any():
            y = y.copy()
            y[:, 2] += lift
        return y


def floor_lift(lowest: Floats, limit: float) -> Floats:
    """(T,) m by which bodies are lifted whose lowest points are at `lowest` (T,) m, and may be at `limit` m."""
    deeper = limit - lowest
    return np.where((deeper > 0.0) & (deeper <= MOST), deeper, 0.0)  # false for what is not finite
