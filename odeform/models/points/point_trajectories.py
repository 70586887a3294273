"""Displacements of many points over time, by a network that moves each by itself."""

import time
from typing import Literal

import numpy as np

from odeform.models.points.arithmetic import Net
from odeform.models.points.point_network import PointBatch, PointNet, sum_of
from odeform.motion.base import SolveStats
from odeform.motion.point_motion import PointFrame
from odeform.motion.splines import catmull_rom
from odeform.motion.threads import thread_map
from odeform.schema import LATER, Window
from odeform.types import Floats, Frames, Points, Times

__all__ = ["TRAJECTORIES", "FramedPoints", "MomentaryPoints", "in_windows", "point_batch"]

CHUNK = 1 << 14  # points times times that a network evaluates at once: its activations stay in the cache
TRAJECTORIES = 256  # points that are rolled out at once, on one core


class MomentaryPoints:
    """Displacements of a network that evaluates any time independently."""

    def __init__(
        self, net: Net, network: PointNet, frame: PointFrame, window: Window, x: Points, theta: Floats
    ) -> None:
        """`x` (N, 3) are points in units of the body's radius of gyration, `theta` (P,) parameters in [-1, 1]."""
        self._net, self._network, self._frame, self._window = net, network, frame, window
        self._x, self._theta = x, np.asarray(theta, dtype=np.float32)

    def stats(self) -> SolveStats:
        """No solver: the network is evaluated at each time directly."""
        return SolveStats("none: a network of the time", 0, 0, 0, "ok", 0.0, lambda: None)

    def displacements(self, times: Times) -> Frames:
        """Maps (T,) seconds to (T, N, 3) metres, canonical."""
        count, out = len(self._x), np.empty((len(times), len(self._x), 3), dtype=np.float32)
        scaled = in_windows(times, self._window)
        together = max(CHUNK // count, 1)
        for first in range(0, len(times), together):
            for begin in range(0, count, CHUNK):
                x, some = self._x[begin : begin + CHUNK], scaled[first : first + together]
                repeated = np.tile(x, (len(some), 1)), np.repeat(some, len(x))[None]
                batch = point_batch(repeated[0], self._theta, repeated[1], self._frame)
                moved = sum_of(self._network.predict(self._net, batch)).reshape(len(some), -1, 3)
                out[first : first + together, begin : begin + CHUNK] = moved
        return out * np.float32(self._frame.scale)


class FramedPoints:
    """Displacements of a network that steps from frame to frame, from rest to where clocks stop.

    Frames never depend on the requested times: those of the window are computed first, and later ones on demand.
    """

    solver: str
    """The integrator, for `stats`."""
    between: Literal["linear", "cubic"]
    """Interpolation between frames."""
    stages: int = 1
    """Evaluations per step."""
    doubled: bool = False
    """Whether steps of twice the length estimate the error of the integration."""

    def __init__(
        self, net: Net, network: PointNet, frame: PointFrame, window: Window, x: Points, theta: Floats
    ) -> None:
        """See `MomentaryPoints`."""
        self._net, self._network, self._frame, self._window = net, network, frame, window
        self._x, self._theta, self._wall_ms = x, theta, 0.0
        self._frames = np.empty((0, len(x), 3), dtype=np.float32)

    def _grid(self, beyond: float) -> Times:
        """(F,) seconds of the frames, from rest to `beyond` windows after the window."""
        window = self._window
        span = (1.0 + beyond) * (window.stop - window.start)
        return window.start + np.arange(int(np.ceil(span * window.rate - 1e-6)) + 1) / window.rate

    def _computed(self, beyond: float) -> Frames:
        """(F, N, 3) metres, canonical: the frames so far, at least to `beyond` windows after the window."""
        grid, frames = self._grid(beyond), self._frames  # once: another thread may replace them
        if len(frames) < len(grid):
            begin = time.perf_counter()
            self._frames = frames = np.concatenate([frames, self._roll_out(grid)[len(frames) :]])
            self._wall_ms += 1e3 * (time.perf_counter() - begin)
        return frames

    def stats(self) -> SolveStats:
        """Solver, steps and elapsed time, once all frames are computed; the solver error where it is known."""
        steps = len(self._computed(LATER)) - 1
        solver = f"{self.solver}, {1e3 / self._window.rate:.3g} ms, {self.between} between frames"
        return SolveStats(solver, steps, steps * self.stages, 0, "ok", self._wall_ms, self._error_mm)

    def displacements(self, times: Times) -> Frames:
        """Maps (T,) seconds to (T, N, 3) metres, canonical."""
        # the window always comes first: products with more rows round differently
        frames = self._computed(LATER)
        if (times > self._window.stop).any():
            frames = self._computed(self._window.reach + LATER)
        last = len(frames) - 1
        phase = np.clip((times - self._window.start) * self._window.rate, 0.0, last)
        near = np.round(phase)
        # a time on a frame gives that frame bit-exactly
        phase = np.where(np.abs(phase - near) < 1e-6, near, phase)
        index = np.minimum(phase.astype(int), last - 1)
        fraction = (phase - index).astype(np.float32)[:, None, None]
        here, there = frames[index], frames[index + 1]
        if self.between == "linear":
            return here + fraction * (there - here)
        before, after = frames[np.maximum(index - 1, 0)], frames[np.minimum(index + 2, last)]
        return catmull_rom(before, here, there, after, fraction)

    def _roll_out(self, grid: Times) -> Frames:
        out = np.empty((len(grid), len(self._x), 3), dtype=np.float32)
        scaled = in_windows(grid, self._window)[:, None]

        def compute(begin: int) -> None:
            x = self._x[begin : begin + TRAJECTORIES]
            batch = point_batch(x, self._theta, np.broadcast_to(scaled, (len(grid), len(x))), self._frame)
            out[:, begin : begin + TRAJECTORIES] = sum_of(self._network.predict(self._net, batch))

        thread_map(compute, range(0, len(self._x), TRAJECTORIES))
        return out * np.float32(self._frame.scale)

    def _error_mm(self) -> float | None:
        """Estimates by step doubling: the largest RMS change over the points with steps of twice the length, halved, as
        these motions bend within a step at contacts."""
        if not self.doubled:
            return None
        grid = self._grid(LATER)
        coarse, fine = self._roll_out(grid[::2]), self._computed(LATER)[: len(grid) : 2]
        return float(1e3 * np.sqrt(((coarse - fine) ** 2).mean(axis=(1, 2))).max() / 2.0)


def in_windows(times: Times, window: Window) -> Floats:
    """(T,) seconds -> float32, 0 at the start of the window and 1 at its end."""
    return ((times - window.start) / (window.stop - window.start)).astype(np.float32)


def point_batch(x: Points, theta: Floats, times: Floats, frame: PointFrame) -> PointBatch:
    """Points (B, 3) from rest under one set of parameters (P,), at times (F, B) in windows."""
    repeated = np.broadcast_to(np.asarray(theta, dtype=np.float32), (len(x), len(theta)))
    return PointBatch(x, repeated, times, np.zeros_like(x), frame.part_scale / frame.scale)
