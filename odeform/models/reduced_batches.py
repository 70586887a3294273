"""What is made of reduced coordinates of many motions, as of one: what a model adds to what it solves for, the motion
after the window, and modes of the body."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from odeform.models.continuation import Dynamics
from odeform.motion.base import SolveStats
from odeform.motion.reduced_batch import BatchTrajectory
from odeform.motion.reduced_space import ReducedSpace
from odeform.motion.splines import catmull_rom
from odeform.schema import Window
from odeform.types import Floats, Times

__all__ = ["ChangedBatch", "ContinuedBatch", "CorrectedBatch", "LiftedBatch", "RolledBatch"]

Coordinates = Float[np.ndarray, "batch times y"]


class ChangedBatch:
    """Motions that are solved as `own` are; a subclass says what their coordinates are."""

    def __init__(self, own: BatchTrajectory) -> None:
        self.own = own

    @property
    def ok(self) -> Bool[np.ndarray, " batch"]:
        """(B,) of `own`."""
        return self.own.ok

    @property
    def stats(self) -> list[SolveStats]:
        """(B,) of `own`."""
        return self.own.stats


class RolledBatch(ChangedBatch):
    """As `RolledTrajectory`, of many motions."""

    def __init__(self, own: BatchTrajectory, space: ReducedSpace) -> None:
        super().__init__(own)
        self._space = space

    def reduced(self, times: Times) -> Coordinates:
        """(T,) s -> (B, T, 6 + K)."""
        y = self.own.reduced(times)
        return self._space.with_modes(y.reshape(-1, y.shape[-1])).reshape(*y.shape[:2], -1)


class ContinuedBatch(ChangedBatch):
    """As `ContinuedTrajectory`, of many motions."""

    def __init__(
        self, own: BatchTrajectory, dynamics: Dynamics, theta: Float[np.ndarray, "batch parameters"], window: Window
    ) -> None:
        super().__init__(own)
        self._dynamics, self._theta = dynamics, theta
        self._stop, self._rate = window.stop, window.rate
        self._frames: list[Floats] = []

    def reduced(self, times: Times) -> Coordinates:
        """(T,) s -> (B, T, 6 + K)."""
        later = times > self._stop
        y = self.own.reduced(np.minimum(times, self._stop))
        if later.any():
            y = y.copy()
            y[:, later] = self._between(self._rate * (times[later] - self._stop))
        return y

    def _between(self, frames: Floats) -> Coordinates:
        """At (T,) frames after the end of the window, as fractions."""
        index = np.floor(frames).astype(int)
        known = list(self._frames) or list(
            self.own.reduced(self._stop - np.array([1.0, 0.0]) / self._rate).swapaxes(0, 1)
        )
        while len(known) < int(index.max()) + 4:
            known.append(self._dynamics.next(known[-2], known[-1], self._theta))
        self._frames = known  # threads that are as far find the same
        kept = np.stack(known, axis=1)
        return catmull_rom(*(kept[:, index + k] for k in range(4)), share=(frames - index)[:, None])


class CorrectedBatch(ChangedBatch):
    """As `CorrectedTrajectory`, of many motions."""

    def __init__(
        self, own: BatchTrajectory, kept: Float[np.ndarray, " y"], rest: Callable[[Times], Coordinates], stop: float
    ) -> None:
        super().__init__(own)
        self._taken, self._rest, self._stop = 1.0 - kept, rest, stop

    def reduced(self, times: Times) -> Coordinates:
        """(T,) s -> (B, T, 6 + K), zero at time 0."""
        own, inside = self.own.reduced(times), np.minimum(times, self._stop)
        added = self._rest(inside)
        if self._taken.any():
            added -= self._taken * (own if (times <= self._stop).all() else self.own.reduced(inside))
        return own + added * (times > 0.0)[:, None]


class LiftedBatch(ChangedBatch):
    """As `LiftedTrajectory`, of many motions."""

    def __init__(self, own: BatchTrajectory, lift: Callable[[Floats], Floats], grid: Times | None = None) -> None:
        """`lift` maps coordinates (R, 6 + K) to m (R,) by which they are lifted."""
        super().__init__(own)
        self._by, self._grid = lift, grid
        self._lift: Float[np.ndarray, "batch grid"] | None = None

    def _lifts(self, y: Coordinates) -> Float[np.ndarray, "batch times"]:
        return self._by(y.reshape(-1, y.shape[-1])).reshape(y.shape[:2])

    def reduced(self, times: Times) -> Coordinates:
        """(T,) s -> (B, T, 6 + K)."""
        y = self.own.reduced(times)
        if self._grid is None:
            lift = self._lifts(y)
        else:
            if self._lift is None:
                self._lift = self._lifts(self.own.reduced(self._grid))
            lift = np.stack([np.interp(times, self._grid, each) for each in self._lift])
        if lift.any():
            y = y.copy()
            y[..., 2] += lift
        return y
