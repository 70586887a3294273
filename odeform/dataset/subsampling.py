"""Which frames of each sequence a model is trained on."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from odeform.errors import InputError
from odeform.schema import Schema
from odeform.types import Bools, Floats, Ints

__all__ = ["FrameSubsampling", "observed_frames"]


@dataclass(frozen=True)
class FrameSubsampling:
    """Which frames are learned from: those of `window` (half-open; default: the scene's), every k-th of them.

    With `stagger` the frames of different sequences interleave: the i-th keeps frames i, i + k, i + 2 k, ... and the
    last, as recordings do that are not triggered together. The first, at rest, is always known.
    """

    window: tuple[int, int] | None = None
    every: int = 1
    stagger: bool = False

    def count(self, schema: Schema) -> int:
        """Frames from the first to the last that is learned from; `InputError` where they do not start at rest, or
        every k-th of them are too few."""
        window, rate = self.window, schema.window.rate
        if window is not None and window[0] != 0:
            raise InputError(f"window {window[0]}:{window[1]}: expected to start at frame 0, where the body is at rest")
        stop = schema.window.stop if window is None else min((window[1] - 1) / rate, schema.window.stop)
        count = round(stop * rate) + 1
        if self.every < 1 or len(range(0, count, self.every)) < 4:
            raise InputError(f"every {self.every}: expected at least 4 frames to learn from among {count}")
        return count if self.stagger else count - (count - 1) % self.every

    def kept(self, count: int, sequence: int) -> Ints:
        """Frames of so many that the sequence of that index shows."""
        if not self.stagger:
            return np.arange(0, count, self.every)
        return np.unique([0, *range(sequence % self.every, count, self.every), count - 1])

    def filled(self, values: Floats, count: int, sequence: int) -> Floats:
        """(kept, ...) at the frames that the sequence shows -> (count, ...), a cubic spline between them."""
        if self.every == 1:
            return values
        frames = np.arange(count)
        return CubicSpline(self.kept(count, sequence), values, axis=0)(frames)

    def known(self, count: int, sequences: int) -> Bools:
        """(S, count) whether the sequence shows the frame."""
        known = np.zeros((sequences, count), dtype=bool)
        for sequence, row in enumerate(known):
            row[self.kept(count, sequence)] = True
        return known


def observed_frames(known: Bools) -> tuple[Ints, Bools]:
    """(S, T) whether frames are known -> (S, K) frames that the sequences show, and whether they do: where one shows
    fewer than another, others of its frames fill up."""
    most = int(known.sum(axis=1).max())
    frames = np.argsort(~known, axis=1, kind="stable")[:, :most]
    return frames, np.take_along_axis(known, frames, axis=1)
