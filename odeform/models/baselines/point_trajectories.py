"""Displacements of many points over time, by a network that moves each by itself."""

import time
from contextvars import copy_context
from typing import Literal

import numpy as np

from odeform.models.baselines.arithmetic import Net
from odeform.models.baselines.point_network import PointNet, Rows, sum_of
from odeform.motion.base import SolveStats
from odeform.motion.point_motion import PointFrame
from odeform.motion.reduced_motion import CORES
from odeform.schema import LATER, Window
from odeform.types import Floats, Frames, Points, Times

__all__ = ["FramedPoints", "MomentaryPoints", "rows_of"]

CHUNK = 1 << 14  # rows of points and times that a network works on at once: its activations stay in the cache
TRAJECTORIES = 256  # points that are rolled out at once, on one core


class MomentaryPoints:
    """Displacements of a network that can be asked for any moment by itself."""

    def __init__(
        self, net: Net, network: PointNet, frame: PointFrame, window: Window, x: Points, theta: Floats
    ) -> None:
        self._net, self._network, self._frame, self._window = net, network, frame, window
        self._x, self._theta = x, np.asarray(theta, dtype=np.float32)

    def stats(self) -> SolveStats:
        return SolveStats("none: a network of the time", 0, 0, 0, "ok", 0.0, lambda: None)

    def displacements(self, times: Times) -> Frames:
        count, out = len(self._x), np.empty((len(times), len(self._x), 3), dtype=np.float32)
        at = in_windows(times, self._window)
        several = max(CHUNK // count, 1)
        for first in range(0, len(times), several):
            for begin in range(0, count, CHUNK):
                x, moments = self._x[begin : begin + CHUNK], at[first : first + several]
                rows = rows_of(
                    np.tile(x, (len(moments), 1)), self._theta, np.repeat(moments, len(x))[None], self._frame
                )
                moved = sum_of(self._network.predict(self._net, rows)).reshape(len(moments), -1, 3)
                out[first : first + several, begin : begin + CHUNK] = moved
        return out * np.float32(self._frame.scale)


class FramedPoints:
    """Displacements of a network that goes on from frame to frame, from rest to where models see no further.

    Frames never depend on what is asked: those of the window are made first, and later ones if any is asked for.
    Between frames motions are `between`.
    """

    solver: str
    between: Literal["linear", "cubic"]
    stages: int = 1
    """Evaluations a step."""
    doubled: bool = False
    """Whether steps of twice the length tell the error of the integration."""

    def __init__(
        self,
        net: Net,
        network: PointNet,
        frame: PointFrame,
        window: Window,
        x: Points,
        theta: Floats,
    ) -> None:
        self._net, self._network, self._frame, self._window = net, network, frame, window
        self._x, self._theta, self._wall_ms = x, theta, 0.0
        self._frames = np.empty((0, len(x), 3), dtype=np.float32)

    def _grid(self, beyond: float) -> Times:
        """(F,) seconds, from rest to so many windows beyond the window."""
        window = self._window
        span = (1.0 + beyond) * (window.stop - window.start)
        return window.start + np.arange(int(np.ceil(span * window.rate - 1e-6)) + 1) / window.rate

    def _made(self, beyond: float) -> Frames:
        """(F, N, 3) metres, canonical: the frames so far, at least to so many windows beyond the window."""
        grid, done = self._grid(beyond), len(self._frames)
        if done < len(grid):
            begin = time.perf_counter()
            self._frames = np.concatenate([self._frames, self._roll_out(grid)[done:]])
            self._wall_ms += 1e3 * (time.perf_counter() - begin)
        return self._frames

    def stats(self) -> SolveStats:
        steps = len(self._made(LATER)) - 1
        solver = f"{self.solver}, {1e3 / self._window.rate:.3g} ms, {self.between} between its frames"
        return SolveStats(solver, steps, steps * self.stages, 0, "ok", self._wall_ms, self._error_mm)

    def displacements(self, times: Times) -> Frames:
        # those of the window always first: products of more rows round otherwise
        frames = self._made(LATER)
        if (times > self._window.stop).any():
            frames = self._made(self._window.reach + LATER)
        last = len(frames) - 1
        phase = np.clip((times - self._window.start) * self._window.rate, 0.0, last)
        near = np.round(phase)
        # on a frame, it is that frame to the last bit
        phase = np.where(np.abs(phase - near) < 1e-6, near, phase)
        index = np.minimum(phase.astype(int), last - 1)
        share = (phase - index).astype(np.float32)[:, None, None]
        one, other = frames[index], frames[index + 1]
        if self.between == "linear":
            return one + share * (other - one)
        # Catmull and Rom 1974: a cubic with the slopes that the neighbours tell
        before, after = frames[np.maximum(index - 1, 0)], frames[np.minimum(index + 2, last)]
        straight, left = other - one, 0.5 * (other - before)
        right = 0.5 * (after - one)
        bend = (1.0 - share) * (left - straight) - share * (right - straight)
        return one + share * straight + share * (1.0 - share) * bend

    def _roll_out(self, grid: Times) -> Frames:
        out = np.empty((len(grid), len(self._x), 3), dtype=np.float32)
        at = in_windows(grid, self._window)[:, None]

        def fill(begin: int) -> None:
            x = self._x[begin : begin + TRAJECTORIES]
            rows = rows_of(x, self._theta, np.broadcast_to(at, (len(grid), len(x))), self._frame)
            out[:, begin : begin + TRAJECTORIES] = sum_of(self._network.predict(self._net, rows))

        begins = range(0, len(self._x), TRAJECTORIES)
        # each is told on its thread whether it is still wanted
        list(CORES.map(lambda context, begin: context.run(fill, begin), [copy_context() for _ in begins], begins))
        return out * np.float32(self._frame.scale)

    def _error_mm(self) -> float | None:
        """By step doubling: the largest RMS over the points, of what steps of twice the length change; half of it, as
        these bend within a step at contacts."""
        if not self.doubled:
            return None
        grid = self._grid(LATER)
        coarse, fine = self._roll_out(grid[::2]), self._made(LATER)[: len(grid) : 2]
        return float(1e3 * np.sqrt(((coarse - fine) ** 2).mean(axis=(1, 2))).max() / 2.0)


def in_windows(times: Times, window: Window) -> Floats:
    """(T,) seconds -> float32, 0 at the start of the window and 1 at its end."""
    return ((times - window.start) / (window.stop - window.start)).astype(np.float32)


def rows_of(x: Points, theta: Floats, times: Floats, frame: PointFrame) -> Rows:
    """Points (B, 3) from rest under one set of parameters (P,), at times (F, B)."""
    spread = np.broadcast_to(np.asarray(theta, dtype=np.float32), (len(x), len(theta)))
    return Rows(x, spread, times, np.zeros_like(x), frame.part_scale / frame.scale)
