"""Reduced coordinates of many motions over time, and those that are made of others."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from odeform.locks import Lock
from odeform.motion.base import SolveStats
from odeform.motion.trajectory import Adjustment
from odeform.types import Times

__all__ = ["AdjustedBatch", "BatchTrajectory", "Coordinates", "PiecewiseBatch"]

Coordinates = Float[np.ndarray, "batch times y"]


@runtime_checkable
class BatchTrajectory(Protocol):
    """Reduced coordinates of B motions over time, each as the `Trajectory` of that motion alone has them."""

    @property
    def ok(self) -> Bool[np.ndarray, " batch"]:
        """(B,) whether the motion is solved as far as it was asked for. What is not is solved by itself."""
        ...

    @property
    def stats(self) -> list[SolveStats]:
        """How they were computed, without estimates of the solver's error."""
        ...

    def reduced(self, times: Times) -> Coordinates:
        """Maps (T,) seconds to (B, T, 6 + K)."""
        ...


class AdjustedBatch:
    """Adjusts many motions as `Adjusted` does one: the adjustment is that of coordinates (B, T, n)."""

    def __init__(self, inner: BatchTrajectory, adjust: Adjustment) -> None:
        self.inner, self._adjust = inner, adjust

    @property
    def ok(self) -> Bool[np.ndarray, " batch"]:
        """As they are of `inner`, (B,)."""
        return self.inner.ok

    @property
    def stats(self) -> list[SolveStats]:
        """As they are of `inner`, (B,)."""
        return self.inner.stats

    def reduced(self, times: Times) -> Coordinates:
        """Maps (T,) s to (B, T, 6 + K)."""
        return self._adjust(times, self.inner.reduced(times))


class PiecewiseBatch:
    """Joins pieces of many motions as `Piecewise` does of one."""

    def __init__(self, inner: BatchTrajectory, stop: float, make_later: Callable[[], BatchTrajectory]) -> None:
        """`make_later` is called at most once; what it returns is asked for times after `stop` only."""
        self.inner, self._stop, self._make_later = inner, stop, make_later
        self._later: BatchTrajectory | None = None
        self._lock = Lock()

    @property
    def ok(self) -> Bool[np.ndarray, " batch"]:
        """(B,) of `inner`, and of what follows it where that was asked for."""
        return self.inner.ok if self._later is None else self.inner.ok & self._later.ok

    @property
    def stats(self) -> list[SolveStats]:
        """As they are of `inner`, (B,)."""
        return self.inner.stats

    def reduced(self, times: Times) -> Coordinates:
        """Maps (T,) s to (B, T, 6 + K)."""
        later = times > self._stop
        if not later.any():
            return self.inner.reduced(times)
        with self._lock:
            if self._later is None:
                self._later = self._make_later()
        after = self._later.reduced(times[later])
        if later.all():
            return after
        y = np.empty((len(after), len(times), after.shape[2]))
        y[:, ~later], y[:, later] = self.inner.reduced(times[~later]), after
        return y
