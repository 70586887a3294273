"""A trajectory that is known at frames: what reduced baselines without dynamics of their own predict."""

import time
from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from odeform.errors import InputError
from odeform.motion.base import SolveStats
from odeform.types import Floats

__all__ = ["FrameTrajectory"]


class FrameTrajectory:
    """Reduced coordinates at frames, a cubic spline between them, and the last frame held beyond."""

    def __init__(self, name: str, times: Floats, predict: Callable[[], Floats]) -> None:
        """`predict` returns (T, 6 + K) at the (T,) `times` in seconds; its run time goes into `stats`.

        Raises `InputError` where that is not finite: the model's file is damaged.
        """
        begin = time.perf_counter()
        with np.errstate(over="ignore", invalid="ignore"):
            frames = predict()
        if not np.isfinite(frames).all():
            raise InputError(f"{name}: the checkpoint predicts numbers that are not finite")
        self._spline = CubicSpline(times, frames, axis=0)
        self._wall_ms = 1e3 * (time.perf_counter() - begin)
        self._name, self._times = name, times
        self._origin = self._spline(times[0])

    @property
    def last_good(self) -> float:
        """Infinite: nothing is integrated, so nothing can fail."""
        return float("inf")

    def reduced(self, times: Floats) -> Floats:
        """Maps (T,) seconds to (T, 6 + K), zero at the first frame."""
        return self._spline(np.clip(times, self._times[0], self._times[-1])) - self._origin

    @property
    def stats(self) -> SolveStats:
        """The model's name and the time of its prediction; no steps, and no estimate of the error."""
        return SolveStats(self._name, 0, 0, 0, "ok", self._wall_ms, lambda: None)
