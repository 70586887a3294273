"""The motion beyond the trained window: a learned autonomous dynamics in phase space.

A latent state that depends on the time knows nothing of times it was not trained on. What a body does next follows
from its position and motion, at any time. From frame to frame of the trained rate,

    y[k+1] = flight(y[k], y[k-1]) + near * sum_j weights[j] exp(-|features(y[k], y[k-1], theta) - centers[j]|^2 / 2).

`flight` is what a body does by itself: constant acceleration of the shift, constant rate of rotation, no deformation.
The sum is what contacts add, and `near` is zero off the ground: kernel ridge regression on centres chosen among
training motions (Rasmussen and Williams, Gaussian Processes for Machine Learning, 8.3.1). Pose and deformation have a
sum each. The deformation also follows from the side of the body that is down. It is that of the contact: it neither
decides where the body goes nor outlasts the contact.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from odeform.checkpoint import Checkpoint
from odeform.geometry.rigid import rotation_from_vector
from odeform.locks import Lock
from odeform.models.kernels.regression import Kernel, KernelRegression
from odeform.motion.base import SolveStats
from odeform.motion.batch_trajectory import BatchTrajectory, PiecewiseBatch
from odeform.motion.reduced_space import POSE
from odeform.motion.splines import catmull_rom
from odeform.motion.trajectory import Moving, Piecewise, Trajectory
from odeform.schema import Window
from odeform.types import Arrays, Floats

__all__ = [
    "LATER_ERRORS",
    "Dynamics",
    "continued",
    "continued_batch",
    "has_continuation",
    "spread_regression",
    "without_continuation",
    "without_side",
]

PREFIX = "continuation."
PARTS = ("pose", "deformation")
UPRIGHT = np.array([0.0, 0.0, 1.0])  # the upward direction, in axes of a body that has not turned
LATER_ERRORS = "val.later_mm"
"""Validation errors of the continuation, by frames after the last that it was given."""


def spread_regression(
    centers: Float[np.ndarray, "centers features"], weights: Float[np.ndarray, "centers outputs"]
) -> KernelRegression:
    """A sum of Gaussian kernels of features that have unit length scales."""
    return KernelRegression(Kernel(np.ones(centers.shape[1]), order=None), centers, weights)


@dataclass(frozen=True, eq=False)
class Dynamics:
    """The next frame of a motion from its last two. Heights are those of the anchor above its rest position."""

    gravity: Float[np.ndarray, "3"]
    """Metres per frame squared."""
    contact_height: float
    """The height in metres below which a body that has not turned is in contact."""
    width: float
    """Metres below `contact_height` over which contacts set in."""
    inverse_lengths: Float[np.ndarray, "features"]
    """The inverse length scales of all features."""
    pose: KernelRegression
    """Its features are those without the side that is down."""
    deformation: KernelRegression

    def flight(self, before: Float[np.ndarray, "*batch y"], now: Float[np.ndarray, "*batch y"]) -> Floats:
        """Predicts the next frame (..., 6 + K) of a body without contact."""
        out = 2.0 * now - before
        out[..., :3] += self.gravity
        out[..., POSE:] = 0.0
        return out

    def features(
        self,
        before: Float[np.ndarray, "*batch y"],
        now: Float[np.ndarray, "*batch y"],
        theta: Float[np.ndarray, "*batch parameters"],
    ) -> tuple[Floats, Floats]:
        """(..., features): depths below `contact_height`, motion since the last frame, parameters, and which side of
        the body is down. And (..., 1) how near the ground is, 0 to 1. All are zero off the ground."""
        ahead = 2.0 * now[..., 2:3] - before[..., 2:3] + self.gravity[2]
        depths = np.maximum(self.contact_height - np.concatenate([ahead, now[..., 2:3]], axis=-1), 0.0)
        near = np.tanh(depths.sum(axis=-1, keepdims=True) / self.width)
        side = rotation_from_vector(now[..., 3:POSE])[..., 2, :] - UPRIGHT
        moving = np.concatenate([(now - before)[..., :POSE], theta, side], axis=-1)
        return self.inverse_lengths * np.concatenate([depths, near * moving], axis=-1), near

    def next(
        self,
        before: Float[np.ndarray, "states y"],
        now: Float[np.ndarray, "states y"],
        theta: Float[np.ndarray, "states parameters"],
    ) -> Float[np.ndarray, "states y"]:
        """Predicts the next frame (S, 6 + K) from the last two."""
        features, near = self.features(before, now, theta)
        out = self.flight(before, now)
        out[:, :POSE] += near * self.pose(without_side(features))
        out[:, POSE:] += near * self.deformation(features)
        return out

    def arrays(self) -> Arrays:
        """The float32 arrays of a checkpoint, by name; `from_arrays` reads them."""
        ground = np.array([self.contact_height, self.width])
        named = {"gravity": self.gravity, "ground": ground, "gains": self.inverse_lengths}
        for name in PARTS:
            part: KernelRegression = getattr(self, name)
            named |= {f"{name}.centers": part.inputs, f"{name}.weights": part.weights}
        return {PREFIX + name: value.astype(np.float32) for name, value in named.items()}

    @classmethod
    def from_arrays(cls, arrays: Arrays, coordinates: int, parameters: int) -> "Dynamics | None":
        """None for a checkpoint without continuation. ValueError unless arrays are finite and of 6 + K coordinates."""
        if not has_continuation(arrays):
            return None
        features = 2 + POSE + parameters + len(UPRIGHT)

        def read(name: str, *shape: int) -> Floats:
            array = arrays[PREFIX + name].astype(float)
            if array.shape != shape or not np.isfinite(array).all():
                raise ValueError(f"{PREFIX}{name}: expected a finite array of shape {shape}, got {array.shape}")
            return array

        def regression(name: str, inputs: int, outputs: int) -> KernelRegression:
            count = len(arrays[f"{PREFIX}{name}.weights"])
            return spread_regression(read(f"{name}.centers", count, inputs), read(f"{name}.weights", count, outputs))

        contact_height, width = read("ground", 2).tolist()
        return cls(
            read("gravity", 3),
            contact_height,
            width,
            read("gains", features),
            regression("pose", features - len(UPRIGHT), POSE),
            regression("deformation", features, coordinates - POSE),
        )


def without_side(features: Float[np.ndarray, "*batch features"]) -> Float[np.ndarray, "*batch fewer"]:
    """The features that the pose follows from."""
    return features[..., : -len(UPRIGHT)]


def has_continuation(arrays: Arrays) -> bool:
    """Whether a checkpoint of these arrays has a continuation that is understood: earlier versions had another one."""
    return f"{PREFIX}pose.weights" in arrays


def without_continuation(checkpoint: Checkpoint) -> Checkpoint:
    """The checkpoint of a model that stops, or goes on by itself, where its trained window ends."""
    arrays = {name: array for name, array in checkpoint.arrays.items() if not name.startswith((PREFIX, LATER_ERRORS))}
    window = replace(checkpoint.schema.window, reach=0.0)
    return replace(checkpoint, arrays=arrays, schema=replace(checkpoint.schema, window=window))


def continued(solved: Trajectory, dynamics: Dynamics, theta: Floats, window: Window) -> Trajectory:
    """A trajectory up to the end of the trained window, bit-exact, and the dynamics for theta (P,) from there on."""
    return Piecewise(solved, window.stop, lambda: _Later(solved, _Frames(solved, dynamics, theta, window)))


def continued_batch(
    solved: BatchTrajectory, dynamics: Dynamics, theta: Float[np.ndarray, "batch parameters"], window: Window
) -> BatchTrajectory:
    """Continues many motions as `continued` does one."""
    return PiecewiseBatch(solved, window.stop, lambda: _LaterBatch(solved, _Frames(solved, dynamics, theta, window)))


class _Frames:
    """Continues the last two frames of a window by the dynamics, of one motion or of many.

    Frames have the trained rate, and each follows from the two before: they never depend on the requested times. The
    spline between them is exact for free flight.
    """

    def __init__(self, solved: Moving, dynamics: Dynamics, theta: Floats, window: Window) -> None:
        self._dynamics, self._theta = dynamics, np.atleast_2d(theta)
        self._stop, self._rate = window.stop, window.rate
        # the first kept frame is one before the end of the window
        first = solved.reduced(window.stop - np.array([1.0, 0.0]) / window.rate)
        self._batch = first.shape[:-2]
        self._frames = list(np.moveaxis(first.reshape(len(self._theta), *first.shape[-2:]), 1, 0))
        self._lock = Lock()

    def reduced(self, times: Floats) -> Floats:
        """(T,) seconds after the window -> (T, 6 + K), or (B, T, 6 + K)."""
        frames = self._rate * (times - self._stop)
        index = np.floor(frames).astype(int)
        with self._lock:
            while len(self._frames) < int(index.max()) + 4:
                before, now = self._frames[-2:]
                self._frames.append(self._dynamics.next(before, now, self._theta))
            kept = np.stack(self._frames, axis=1)
        four = [kept[:, index + k] for k in range(4)]
        y = catmull_rom(*four, fraction=(frames - index)[:, None])
        return y.reshape(*self._batch, *y.shape[1:])


class _Later:
    """The trajectory of frames after those that are solved."""

    last_good = float("inf")

    def __init__(self, solved: Trajectory, frames: _Frames) -> None:
        self._solved, self.reduced = solved, frames.reduced

    @property
    def stats(self) -> SolveStats:
        """Statistics of the window's solution."""
        return self._solved.stats


class _LaterBatch:
    """Continues many motions as `_Later` does one."""

    def __init__(self, solved: BatchTrajectory, frames: _Frames) -> None:
        self._solved, self.reduced = solved, frames.reduced

    @property
    def ok(self) -> Bool[np.ndarray, " batch"]:
        """(B,) statistics of the window's solutions."""
        return self._solved.ok

    @property
    def stats(self) -> list[SolveStats]:
        """(B,) statistics of the window's solutions."""
        return self._solved.stats
