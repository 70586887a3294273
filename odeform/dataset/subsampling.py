"""Chooses which frames of each sequence a model is trained on."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from odeform.errors import InputError
from odeform.schema import Schema
from odeform.types import Bools, Floats, Ints

__all__ = ["FrameSubsampling", "observed_frames"]


@dataclass(frozen=True)
class FrameSubsampling:
    """Training on every n-th frame of a window."""

    window: tuple[int, int] | None = None
    """Half-open, in frames; None for the window of the scene."""
    every: int = 1
    """n, the distance of observed frames."""
    stagger: bool = False
    """Whether the frames of different sequences interleave, as in recordings without a common trigger: sequence i keeps
    frames i, i + n, i + 2 n, ... and the last. Frame 0, at rest, is always kept."""

    def count(self, schema: Schema) -> int:
        """Number of frames up to the last observed one. Raises `InputError` if the window does not start at rest, or
        contains fewer than 4 observed frames."""
        window, rate = self.window, schema.window.rate
        if window is not None and window[0] != 0:
            raise InputError(f"window {window[0]}:{window[1]}: expected to start at frame 0, where the body is at rest")
        stop = schema.window.stop if window is None else min((window[1] - 1) / rate, schema.window.stop)
        count = round(stop * rate) + 1
        if self.every < 1 or len(range(0, count, self.every)) < 4:
            raise InputError(f"every {self.every}: expected at least 4 training frames among {count}")
        return count if self.stagger else count - (count - 1) % self.every

    def kept(self, count: int, sequence: int) -> Ints:
        """Computes (F,) increasing indices of the observed frames, out of `count`, of the sequence with that index."""
        if not self.stagger:
            return np.arange(0, count, self.every)
        return np.unique([0, *range(sequence % self.every, count, self.every), count - 1])

    def interpolated(self, values: Floats, count: int, sequence: int) -> Floats:
        """Maps values at the observed frames of a sequence (K, ...) to (count, ...), by cubic splines."""
        if self.every == 1:
            return values
        frames = np.arange(count)
        return CubicSpline(self.kept(count, sequence), values, axis=0)(frames)

    def observed(self, count: int, sequences: int) -> Bools:
        """(S, count) whether each frame of each sequence is observed."""
        observed = np.zeros((sequences, count), dtype=bool)
        for sequence, row in enumerate(observed):
            row[self.kept(count, sequence)] = True
        return observed


def observed_frames(observed: Bools) -> tuple[Ints, Bools]:
    """(S, T) whether frames are observed -> (S, K) their indices, and whether each of those is observed: sequences with
    fewer than K are padded by other frames."""
    most = int(observed.sum(axis=1).max())
    frames = np.argsort(~observed, axis=1, kind="stable")[:, :most]
    return frames, np.take_along_axis(observed, frames, axis=1)
