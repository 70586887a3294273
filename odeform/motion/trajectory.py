"""Reduced coordinates over time, and trajectories that are made of others."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from odeform.locks import Lock
from odeform.motion.base import SolveStats
from odeform.motion.recent import Recent
from odeform.types import Floats, Times

__all__ = ["Adjusted", "Adjustment", "Moving", "Piecewise", "Shown", "Trajectory"]

RECENT = 4  # results that are kept

Adjustment = Callable[[Times, Floats], Floats]
"""(T,) seconds and coordinates (T, n) there -> coordinates (T, m); of many motions, (B, T, n) -> (B, T, m)."""


@runtime_checkable
class Moving(Protocol):
    """Has reduced coordinates over time: one motion, or many."""

    def reduced(self, times: Times) -> Float[np.ndarray, "*batch times y"]:
        """Maps (T,) seconds to (T, 6 + K), or (B, T, 6 + K)."""
        ...


@runtime_checkable
class Trajectory(Protocol):
    """Reduced coordinates over time. The result for a time never depends on earlier requests."""

    @property
    def stats(self) -> SolveStats:
        """How the trajectory was computed."""
        ...

    @property
    def last_good(self) -> float:
        """Seconds up to which the trajectory is valid; later times show the state at that time."""
        ...

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """Maps (T,) seconds to (T, 6 + K)."""
        ...


class Adjusted:
    """The coordinates of another trajectory, changed moment by moment."""

    def __init__(self, inner: Trajectory, adjust: Adjustment) -> None:
        self.inner, self._adjust = inner, adjust

    @property
    def stats(self) -> SolveStats:
        """How `inner` was computed."""
        return self.inner.stats

    @property
    def last_good(self) -> float:
        """Seconds up to which `inner` is valid."""
        return self.inner.last_good

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """Maps (T,) s to (T, 6 + K)."""
        return self._adjust(times, self.inner.reduced(times))


class Shown(Adjusted):
    """An adjusted trajectory whose last results are kept: pose, deformation and gradient of a time are evaluated one
    after the other. They are read-only."""

    def __init__(self, inner: Trajectory, adjust: Adjustment) -> None:
        super().__init__(inner, adjust)
        self._recent: Recent[Floats] = Recent(RECENT)

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """Maps (T,) s to (T, 6 + K)."""
        requested = np.asarray(times, dtype=float)

        def adjusted() -> Floats:
            y = super(Shown, self).reduced(requested)
            y.flags.writeable = False
            return y

        return self._recent.get(requested.tobytes(), adjusted)


class Piecewise:
    """One trajectory up to `stop` seconds, and from there on another, which is made when it is first asked for."""

    def __init__(self, inner: Trajectory, stop: float, make_later: Callable[[], Trajectory]) -> None:
        """`make_later` is called at most once, and not if `inner` fails before `stop`: it then stays at its last state.

        The later trajectory is asked for times after `stop` only.
        """
        self.inner, self._stop, self._make_later = inner, stop, make_later
        self._later: Trajectory | None = None
        self._lock = Lock()

    @property
    def stats(self) -> SolveStats:
        """How `inner` was computed."""
        return self.inner.stats

    @property
    def last_good(self) -> float:
        """Seconds up to which it is valid, as far as it is known."""
        good = self.inner.last_good
        return good if good < self._stop or self._later is None else self._later.last_good

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """Maps (T,) s to (T, 6 + K)."""
        times = np.asarray(times, dtype=float)
        later = times > self._stop
        if not later.any() or self.inner.last_good < self._stop:
            return self.inner.reduced(np.minimum(times, self._stop))
        with self._lock:
            if self._later is None:
                self._later = self._make_later()
        after = self._later.reduced(times[later])
        if later.all():
            return after
        y = np.empty((len(times), after.shape[1]))
        y[~later], y[later] = self.inner.reduced(times[~later]), after
        return y
