"""The dynamics that continue motions beyond the window: fitted to training motions, kept where they predict well."""

from dataclasses import replace
from typing import TypeGuard

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.models.base import Predictor
from odeform.models.continuation import (
    LATER_ERRORS,
    Dynamics,
    continued,
    spread_regression,
    without_side,
)
from odeform.models.kernels.functions import gaussian
from odeform.models.kernels.regression import KernelRegression
from odeform.models.reduced_model import ReducedModel
from odeform.motion.reduced_space import POSE, small_motion
from odeform.schema import REACH
from odeform.types import Floats

__all__ = ["HELD_OUT", "fit_dynamics", "predicted_errors", "with_continuation"]

# chosen on validation sequences: of `mass-elastic`, after 40 to 90 frames; of `kick`, up to twice its window
CENTERS = 300
RIDGE = 1e-7  # on the mean square over states
PARAMETERS = 0.3  # inverse length scale of parameters, in halves of their range; depths and velocities have 1
SIDE = 2.0  # inverse length scale of the side that is down, a unit vector
WIDTH = 0.05  # of the largest depth
FREE = 0.01  # fraction of the largest acceleration besides gravity, below which there is no contact
CANDIDATES = 12_000  # states among which centres are chosen
HELD_OUT = 1.0 / 3.0
"""Fraction of the window over which a continuation is validated."""
FEWEST = 3  # frames that it can be fitted to
TINY = 1e-9  # metres; against division by zero


def _largest(vectors: Floats) -> float:
    return max(float(np.linalg.norm(vectors, axis=1).max()), TINY)


def _ground(before: Floats, now: Floats, after: Floats) -> tuple[Floats, float, float]:
    """Gravity in metres per frame squared, the height of first contact, and the largest depth below it, in metres.

    Bodies in the upper half of their heights are assumed to fly.
    """
    acceleration = (after - 2.0 * now + before)[:, :3]
    height = now[:, 2]
    gravity = np.median(acceleration[height >= 0.5 * (height.min() + height.max())], axis=0)
    pushed = np.linalg.norm(acceleration - gravity, axis=1)
    lowest = np.minimum(height, 2.0 * height - before[:, 2] + gravity[2])
    contact_height = float(np.quantile(lowest[pushed >= FREE * pushed.max()], 0.99))
    return gravity, contact_height, max(contact_height - float(lowest.min()), TINY)


def _spread(features: Floats, count: int) -> Floats:
    """(C, F) of the features (S, F), chosen so that the kernel explains the others best.

    Each is the one that those before it explain least: pivoted Cholesky (Fine and Scheinberg 2001).
    """
    unexplained, factor, chosen = np.ones(len(features)), np.zeros((len(features), count)), []
    while len(chosen) < count and unexplained.max(initial=0.0) > 1e-7:
        pivot, rank = int(unexplained.argmax()), len(chosen)
        column = gaussian(features, features[pivot : pivot + 1])[:, 0]
        column -= factor[:, :rank] @ factor[pivot, :rank]
        factor[:, rank] = column / np.sqrt(unexplained[pivot])
        unexplained -= factor[:, rank] ** 2
        unexplained[pivot] = 0.0
        chosen.append(pivot)
    return features[chosen]


def _regression(features: Floats, near: Floats, outputs: Floats, rng: np.random.Generator) -> KernelRegression:
    """Fits outputs (S, O) as `near` (S, 1) times a sum of kernels of features (S, F)."""
    touching = rng.permutation(np.flatnonzero(near[:, 0]))[:CANDIDATES]
    centers = _spread(features[touching], CENTERS)
    values = near * gaussian(features, centers)
    normal = values.T @ values + RIDGE * len(features) * gaussian(centers, centers)
    normal[np.diag_indices_from(normal)] += 1e-10 * np.trace(normal) / max(len(normal), 1)  # against rounding
    return spread_regression(centers, np.linalg.solve(normal, values.T @ outputs))


def fit_dynamics(theta: Floats, reduced: Floats, gyration_radius: float) -> Dynamics:
    """Fit to parameters (S, P) in [-1, 1] and motions (S, T, 6 + K) of at least `FEWEST` frames, which nothing but the
    ground drives."""
    before, now, after = (reduced[:, k : reduced.shape[1] - 2 + k].reshape(-1, reduced.shape[2]) for k in range(3))
    conditions = np.repeat(theta, reduced.shape[1] - 2, axis=0)
    gravity, contact_height, depth = _ground(before, now, after)
    speed = _largest((now - before)[:, :3])
    sizes = [(1.0 / depth, 2), (1.0 / speed, 3), (gyration_radius / speed, 3), (PARAMETERS, theta.shape[1]), (SIDE, 3)]
    inverse_lengths = np.concatenate([np.full(count, inverse) for inverse, count in sizes])
    empty = spread_regression(np.zeros((0, 0)), np.zeros((0, 0)))
    dynamics = Dynamics(gravity, contact_height, WIDTH * depth, inverse_lengths, empty, empty)
    features, near = dynamics.features(before, now, conditions)
    residual, rng = after - dynamics.flight(before, now), np.random.default_rng(0)
    return replace(
        dynamics,
        pose=_regression(without_side(features), near, residual[:, :POSE], rng),
        deformation=_regression(features, near, residual[:, POSE:], rng),
    )


def _fitted(data: TrainingData, frames: int) -> Dynamics | None:
    """Fitted to the first `frames` of the training motions, without those in which the body is driven; None where too
    few are left."""
    free = data.reduced["train"][:, data.first_free : frames]
    return None if free.shape[1] < FEWEST else fit_dynamics(data.theta["train"], free, data.space.gyration_radius)


def predicted_errors(model: ReducedModel, data: TrainingData) -> Floats | None:
    """(S, L) RMSE in mm of the validation motions over the last third of the window, which is held out of the fit, when
    continued from the model's own motions. None if motions that stop there have smaller errors, and where a spline
    filled in frames: it knows no contacts."""
    kept = round((1.0 - HELD_OUT) * len(data.times))
    dynamics = _fitted(data, kept) if data.observed["train"].all() else None
    if dynamics is None:
        return None
    window = replace(data.schema.window, stop=float(data.times[kept - 1]))
    evaluated, later = model.evaluate_basis(model.rest, 0.0), data.times[kept:]
    moving, stopped = [], []
    for theta in data.theta["val"]:
        motion = model.trajectory(theta, evaluated, model.qualities.get("reference"), window.stop)
        moving.append(continued(motion, dynamics, theta, window).reduced(later))
        stopped.append(motion.reduced(np.full(len(later), window.stop)))
    truth, gyration_radius = data.reduced["val"][:, kept:], data.space.gyration_radius
    guesses = (np.stack(guess) - truth for guess in (moving, stopped))
    moved, stayed = (small_motion(residual, gyration_radius) / np.sqrt(3.0) for residual in guesses)
    return 1e3 * moved if np.square(moved).mean() < np.square(stayed).mean() else None


def with_continuation(model: ReducedModel, data: TrainingData) -> Checkpoint:
    """Returns the checkpoint of a trained `model` with the dynamics that continue it and their validation errors.

    It is unchanged where these dynamics predict worse than motions that stop.
    """
    errors, checkpoint = predicted_errors(model, data), model.checkpoint
    dynamics = None if errors is None else _fitted(data, len(data.times))
    if errors is None or dynamics is None:
        return checkpoint
    schema = replace(checkpoint.schema, window=replace(checkpoint.schema.window, reach=REACH))
    arrays = {**checkpoint.arrays, **dynamics.arrays(), LATER_ERRORS: errors.astype(np.float32)}
    return replace(checkpoint, schema=schema, arrays=arrays)


def is_continued(model: Predictor) -> TypeGuard[ReducedModel]:
    """Whether motions of this model go on beyond its window by these dynamics, where they predict well enough."""
    return isinstance(model, ReducedModel) and not model.schema.objects and not model.continues_itself
