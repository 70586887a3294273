"""The dynamics that continue motions beyond the window: fitted to training motions, kept where they predict well."""

from dataclasses import replace

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.models.continuation import LATER_ERRORS, ContinuedTrajectory, Dynamics, kernel
from odeform.models.reduced_model import ReducedModel
from odeform.motion.reduced_space import POSE, small_motion
from odeform.schema import REACH
from odeform.types import Floats

__all__ = ["fit_dynamics", "predicted_errors", "with_continuation"]

# chosen on validation sequences of `mass-elastic`, ten frames beyond windows of 40, 45, 50, 60, 65, 70, 80 and 90
CENTERS = 300
RIDGE = 1e-7  # on the mean square over states
MOTION = 0.3  # gain of changes of deformation, relative to the largest; depths, velocities and deformations have 1
PARAMETERS = 0.3  # gain of parameters, in halves of their range
WIDTH = 0.05  # of the largest depth
FREE = 0.01  # share of the largest acceleration besides gravity, below which there is no contact
CANDIDATES = 20_000  # states among which centres are chosen
TINY = 1e-9  # metres; against division by zero


def _largest(vectors: Floats) -> float:
    return max(float(np.linalg.norm(vectors, axis=1).max()), TINY)


def _ground(before: Floats, now: Floats, after: Floats) -> tuple[Floats, float, float]:
    """Gravity in metres per frame squared, the height of first touch, and the largest depth below it, in metres.

    Bodies in the upper half of their heights are assumed to fly.
    """
    acceleration = (after - 2.0 * now + before)[:, :3]
    height = now[:, 2]
    gravity = np.median(acceleration[height >= 0.5 * (height.min() + height.max())], axis=0)
    pushed = np.linalg.norm(acceleration - gravity, axis=1)
    lowest = np.minimum(height, 2.0 * height - before[:, 2] + gravity[2])
    touch = float(np.quantile(lowest[pushed >= FREE * pushed.max()], 0.99))
    return gravity, touch, max(touch - float(lowest.min()), TINY)


def _spread(features: Floats, count: int) -> Floats:
    """(C, F) of the features (S, F), chosen so that the kernel explains the others best.

    Each is the one that those before it explain least: pivoted Cholesky (Fine and Scheinberg 2001).
    """
    unexplained, factor, chosen = np.ones(len(features)), np.zeros((len(features), count)), []
    while len(chosen) < count and unexplained.max() > 1e-7:
        pivot, rank = int(unexplained.argmax()), len(chosen)
        column = kernel(features, features[pivot : pivot + 1])[:, 0]
        column -= factor[:, :rank] @ factor[pivot, :rank]
        factor[:, rank] = column / np.sqrt(unexplained[pivot])
        unexplained -= factor[:, rank] ** 2
        unexplained[pivot] = 0.0
        chosen.append(pivot)
    return features[chosen]


def fit_dynamics(theta: Floats, reduced: Floats, gyration_radius: float, seed: int = 0) -> Dynamics:
    """Fit to parameters (S, P) in [-1, 1] and motions (S, T, 6 + K) of at least three frames."""
    before, now, after = (reduced[:, k : reduced.shape[1] - 2 + k].reshape(-1, reduced.shape[2]) for k in range(3))
    conditions = np.repeat(theta, reduced.shape[1] - 2, axis=0)
    gravity, touch, depth = _ground(before, now, after)
    change = now - before
    speed, bent, bending = (_largest(part) for part in (change[:, :3], now[:, POSE:], change[:, POSE:]))
    modes = reduced.shape[2] - POSE
    sizes = [(1 / depth, 2), (1 / speed, 3), (gyration_radius / speed, 3), (1 / bent, modes), (MOTION / bending, modes)]
    sizes.append((PARAMETERS, theta.shape[1]))
    gains = np.concatenate([np.full(count, gain) for gain, count in sizes])
    empty = np.zeros((0, len(gains))), np.zeros((0, reduced.shape[2]))
    dynamics = Dynamics(gravity, touch, WIDTH * depth, gains, *empty)
    features = dynamics.features(before, now, conditions)
    drawn = np.random.default_rng(seed).permutation(len(features))[:CANDIDATES]
    centers = _spread(features[drawn], CENTERS)
    values = kernel(features, centers)
    normal = values.T @ values + RIDGE * len(features) * kernel(centers, centers)
    normal[np.diag_indices_from(normal)] += 1e-10 * np.trace(normal) / len(normal)  # against rounding
    weights = np.linalg.solve(normal, values.T @ (after - dynamics.flight(before, now)))
    return replace(dynamics, centers=centers, weights=weights)


def predicted_errors(model: ReducedModel, data: TrainingData) -> Floats | None:
    """(S, L) RMSE in mm of the validation motions over the last third of the window, which is held out of the fit, when
    continued from the model's own motions. None if motions that stop there have smaller errors, and where a spline
    filled in frames: it knows no contacts."""
    kept = round(len(data.times) / (1.0 + REACH))
    if kept < 4 or not data.observed["train"].all():
        return None
    dynamics = fit_dynamics(data.theta["train"], data.reduced["train"][:, :kept], data.space.gyration_radius)
    window = replace(data.schema.window, stop=float(data.times[kept - 1]))
    evaluated, later = model.evaluate_basis(model.rest, 0.0), data.times[kept:]
    continued, stopped = [], []
    for theta in data.theta["val"]:
        motion = model.trajectory(theta, evaluated, model.qualities.get("reference"), window.stop)
        continued.append(ContinuedTrajectory(motion, dynamics, theta, window).reduced(later))
        stopped.append(motion.reduced(np.full(len(later), window.stop)))
    truth, gyration_radius = data.reduced["val"][:, kept:], data.space.gyration_radius
    moved, held = (
        small_motion(np.stack(guess) - truth, gyration_radius) / np.sqrt(3.0) for guess in (continued, stopped)
    )
    return 1e3 * moved if np.square(moved).mean() < np.square(held).mean() else None


def with_continuation(model: ReducedModel, data: TrainingData) -> Checkpoint:
    """The checkpoint of a trained `model` with the dynamics that continue it and their validation errors.

    It is unchanged where these dynamics predict worse than motions that stop.
    """
    errors, checkpoint = predicted_errors(model, data), model.checkpoint
    if errors is None:
        return checkpoint
    dynamics = fit_dynamics(data.theta["train"], data.reduced["train"], data.space.gyration_radius)
    schema = replace(checkpoint.schema, window=replace(checkpoint.schema.window, reach=REACH))
    arrays = {**checkpoint.arrays, **dynamics.arrays(), LATER_ERRORS: errors.astype(np.float32)}
    return replace(checkpoint, schema=schema, arrays=arrays)
