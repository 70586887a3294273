"""What simple methods reach that are given the truth: the last frame held, ballistic flight, a spline through frames.

They tell what a table of extrapolation or interpolation is worth: a model that is given parameters alone has to beat
what anybody could say who had seen the frames.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.evaluation.scores import Scores
from odeform.simulation.physics import GRAVITY
from odeform.types import Frames, MotionSequence

__all__ = ["ballistic", "evaluate_simple", "hold_last", "spline_through"]

Guess = Callable[[MotionSequence, int], Frames]
"""From a true sequence, the i-th of its split, to frames at its times, (T, N, 3) metres."""


def hold_last(known: int) -> Guess:
    """The last of the first `known` frames, held."""
    return lambda truth, _: truth.vertices[np.minimum(np.arange(len(truth.times)), known - 1)]


def ballistic(known: int, gravity: float = GRAVITY) -> Guess:
    """From the last of the first `known` frames on, its shape flies on with the centre's velocity under `gravity`.

    `gravity` is in m/s^2, along -z.
    """

    def fly(truth: MotionSequence, index: int) -> Frames:
        step = float(truth.times[1] - truth.times[0])
        before, last = truth.vertices[known - 2 : known].astype(float)
        down = np.array([0.0, 0.0, -gravity])
        # the centre's mean velocity over the last interval, and what gravity adds in its second half
        velocity = truth.weights @ (last - before) / step + 0.5 * down * step
        ahead = np.maximum(truth.times - truth.times[known - 1], 0.0)[:, None]
        shift = ahead * velocity + 0.5 * ahead**2 * down
        return hold_last(known)(truth, index) + shift[:, None]

    return fly


def spline_through(subsampling: FrameSubsampling) -> Guess:
    """The cubic spline through the frames that are kept."""

    def join(truth: MotionSequence, index: int) -> Frames:
        count = len(truth.times)
        return subsampling.interpolated(truth.vertices[subsampling.kept(count, index)], count, index)

    return join


def evaluate_simple(guess: Guess, dataset: Dataset, split: str, window: tuple[int, int]) -> dict[str, Any]:
    """Scores over the frames `window` (half-open), as `evaluate` gives them for a model."""
    schema, scores = dataset.schema, Scores()
    for index, recorded in enumerate(dataset.sequences(split)):
        truth = recorded.frames(schema.window.stop, schema.window.rate)
        inside = np.zeros(len(truth.times), dtype=bool)
        inside[[0, *range(*window)]] = True
        part = replace(truth, times=truth.times[inside], vertices=truth.vertices[inside])
        counted = np.ones(len(part.times), dtype=bool)
        scores.add(guess(truth, index)[inside], part, counted, np.zeros_like(counted))
    return scores.result()
