"""Simple predictors that are given true frames: hold the last frame, ballistic flight, a spline through frames.

They are the reference for tables of extrapolation and interpolation: a model that is given only parameters should beat
what the frames themselves suggest.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.evaluation.scores import Scores
from odeform.models.continuation import Dynamics
from odeform.motion.reduced_space import POSE, ReducedSpace, decompose, rotation_of, to_canonical
from odeform.schema import Schema
from odeform.simulation.physics import GRAVITY
from odeform.types import Frames, MotionSequence

__all__ = ["SimplePredictor", "ballistic", "continued", "evaluate_simple", "hold_last", "spline_through"]

SimplePredictor = Callable[[MotionSequence, int], Frames]
"""Predicts frames (T, N, 3) m from a true sequence and its index in the split."""


def hold_last(observed: int) -> SimplePredictor:
    """Hold the last of the first `observed` frames."""
    return lambda truth, _: truth.vertices[np.minimum(np.arange(len(truth.times)), observed - 1)]


def ballistic(observed: int, gravity: float = GRAVITY) -> SimplePredictor:
    """Predicts the ballistic flight of the shape of the last of the first `observed` frames, from the velocity of its
    centre.

    `gravity` is in m/s^2, along -z.
    """

    def fly(truth: MotionSequence, index: int) -> Frames:
        step = float(truth.times[1] - truth.times[0])
        before, last = truth.vertices[observed - 2 : observed].astype(float)
        down = np.array([0.0, 0.0, -gravity])
        # the mean velocity of the centre over the last interval, plus the effect of gravity in its second half
        velocity = truth.weights @ (last - before) / step + 0.5 * down * step
        ahead = np.maximum(truth.times - truth.times[observed - 1], 0.0)[:, None]
        shift = ahead * velocity + 0.5 * ahead**2 * down
        return hold_last(observed)(truth, index) + shift[:, None]

    return fly


def continued(observed: int, dynamics: Dynamics, space: ReducedSpace, schema: Schema) -> SimplePredictor:
    """Continue the first `observed` frames as models of reduced coordinates are continued beyond their windows.

    The last two of these frames are projected onto the basis of `space`, whose training mesh the sequences must have.
    """

    def go_on(truth: MotionSequence, index: int) -> Frames:
        azimuth = schema.azimuth(truth.parameters)
        given = replace(truth, times=truth.times[:observed], vertices=truth.vertices[:observed])
        pose, deformation = decompose(given, space.anchor, azimuth)
        rest = to_canonical(truth.vertices[0], space.anchor, azimuth)
        modes = space.basis.values(rest)
        flat, root = modes.reshape(-1, modes.shape[-1]), np.sqrt(np.repeat(truth.weights, 3))
        last = (deformation[-2:].reshape(2, -1) * root) @ np.linalg.pinv(flat * root[:, None]).T
        frames = list(np.concatenate([pose[-2:], last], axis=1))
        theta = schema.vector(truth.parameters)[None]
        while len(frames) < len(truth.times) - observed + 2:
            frames.append(dynamics.next(frames[-2][None], frames[-1][None], theta)[0])
        later = np.stack(frames[2:]).reshape(-1, POSE + modes.shape[-1])
        rotation, shift = rotation_of(later[:, :POSE], azimuth)
        body = rest + (later[:, POSE:] @ flat.T).reshape(-1, *rest.shape)
        moved = np.einsum("tij,tnj->tni", rotation, body) + (shift + space.anchor)[:, None]
        return np.concatenate([given.vertices, moved.astype(np.float32)])

    return go_on


def spline_through(subsampling: FrameSubsampling) -> SimplePredictor:
    """Cubic spline through the frames that `subsampling` keeps."""

    def join(truth: MotionSequence, index: int) -> Frames:
        count = len(truth.times)
        return subsampling.interpolated(truth.vertices[subsampling.kept(count, index)], count, index)

    return join


def evaluate_simple(predict: SimplePredictor, dataset: Dataset, split: str, window: tuple[int, int]) -> dict[str, Any]:
    """Scores over the frames `window` (half-open), as `evaluate` computes them for a model."""
    schema, scores = dataset.schema, Scores()
    for index, recorded in enumerate(dataset.sequences(split)):
        truth = recorded.frames(schema.window.stop, schema.window.rate)
        inside = np.zeros(len(truth.times), dtype=bool)
        inside[[0, *range(*window)]] = True
        part = replace(truth, times=truth.times[inside], vertices=truth.vertices[inside])
        counted = np.ones(len(part.times), dtype=bool)
        scores.add(predict(truth, index)[inside], part, counted, np.zeros_like(counted))
    return scores.result()
