"""The motion beyond the trained window: a learned autonomous dynamics in phase space.

A latent state that is told the time knows nothing of times it was not trained on. What a body does next follows from
where it is, how it moves and how it is deformed, whatever the time. From frame to frame of the trained rate,

    y[k+1] = flight(y[k], y[k-1]) + sum_j weights[j] exp(-|features(y[k], y[k-1], theta) - centers[j]|^2 / 2).

`flight` is the prior: constant acceleration of the shift, constant rate of turn, no deformation. The rest is what the
training motions do otherwise, at contacts: kernel ridge regression on centres chosen among them (Rasmussen and
Williams, Gaussian Processes for Machine Learning, 8.3.1). Far from all of them it is zero, and the body flies.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.motion.base import SolveStats
from odeform.motion.reduced_motion import Trajectory
from odeform.motion.reduced_space import POSE
from odeform.schema import Window
from odeform.types import Arrays, Floats

__all__ = ["ContinuedTrajectory", "Dynamics", "kernel"]

PREFIX = "continuation."


def kernel(
    features: Float[np.ndarray, "states features"], centers: Float[np.ndarray, "centers features"]
) -> Float[np.ndarray, "states centers"]:
    squares = (features**2).sum(axis=-1)[:, None] + (centers**2).sum(axis=-1)
    return np.exp(np.minimum(features @ centers.T - 0.5 * squares, 0.0))


@dataclass(frozen=True, eq=False)
class Dynamics:
    """The next frame of a motion from its last two. Heights are those of the anchor above where it rests."""

    gravity: Float[np.ndarray, "3"]
    """Metres per frame squared."""
    touch: float
    """The height in metres below which a body that has not turned meets something."""
    width: float
    """Metres below `touch` over which motion comes to matter."""
    gains: Float[np.ndarray, "features"]
    centers: Float[np.ndarray, "centers features"]
    weights: Float[np.ndarray, "centers y"]

    def flight(self, before: Float[np.ndarray, "*batch y"], now: Float[np.ndarray, "*batch y"]) -> Floats:
        """The next frame (..., 6 + K) of a body that meets nothing."""
        out = 2.0 * now - before
        out[..., :3] += self.gravity
        out[..., POSE:] = 0.0
        return out

    def features(
        self,
        before: Float[np.ndarray, "*batch y"],
        now: Float[np.ndarray, "*batch y"],
        theta: Float[np.ndarray, "*batch parameters"],
    ) -> Floats:
        """(..., features): depths below `touch`, motion since the last frame, deformation and parameters.

        Off the ground an undeformed body has none: all of free flight is one place, of any height, speed and mass.
        """
        ahead = 2.0 * now[..., 2:3] - before[..., 2:3] + self.gravity[2]
        depths = np.maximum(self.touch - np.concatenate([ahead, now[..., 2:3]], axis=-1), 0.0)
        near = np.tanh(depths.sum(axis=-1, keepdims=True) / self.width)
        change = now - before
        parts = [depths, near * change[..., :POSE], now[..., POSE:], change[..., POSE:], near * theta]
        return self.gains * np.concatenate(parts, axis=-1)

    def next(
        self,
        before: Float[np.ndarray, "states y"],
        now: Float[np.ndarray, "states y"],
        theta: Float[np.ndarray, "states parameters"],
    ) -> Float[np.ndarray, "states y"]:
        return self.flight(before, now) + kernel(self.features(before, now, theta), self.centers) @ self.weights

    def arrays(self) -> Arrays:
        named = {"gravity": self.gravity, "ground": np.array([self.touch, self.width])}
        named |= {"gains": self.gains, "centers": self.centers, "weights": self.weights}
        return {PREFIX + name: value.astype(np.float32) for name, value in named.items()}

    @classmethod
    def from_arrays(cls, arrays: Arrays, coordinates: int, parameters: int) -> "Dynamics | None":
        """None where a checkpoint has none. ValueError unless they are of 6 + K coordinates, and finite."""
        if PREFIX + "weights" not in arrays:
            return None
        gravity, ground, gains, centers, weights = (
            arrays[PREFIX + name].astype(float) for name in ("gravity", "ground", "gains", "centers", "weights")
        )
        features = 2 + POSE + 2 * (coordinates - POSE) + parameters
        count = len(weights)
        wanted = ((3,), (2,), (features,), (count, features), (count, coordinates))
        for array, shape in zip((gravity, ground, gains, centers, weights), wanted, strict=True):
            if array.shape != shape or not np.isfinite(array).all():
                raise ValueError(f"{PREFIX}: expected finite arrays, one of shape {shape}, got {array.shape}")
        return cls(gravity, float(ground[0]), float(ground[1]), gains, centers, weights)


class ContinuedTrajectory:
    """A trajectory up to the end of the trained window, to the last bit as it is, and the dynamics from there on.

    Frames of the trained rate, each from the two before: whatever times are asked for, they are the same ones. Between
    them a cubic with central differences for slopes (Catmull and Rom 1974), which is exact for free flight.
    """

    def __init__(self, known: Trajectory, dynamics: Dynamics, theta: Floats, window: Window) -> None:
        self._known, self._dynamics, self._theta = known, dynamics, theta
        self._stop, self._rate = window.stop, window.rate
        self._frames: list[Floats] = []

    @property
    def stats(self) -> SolveStats:
        return self._known.stats

    @property
    def last_good(self) -> float:
        return self._known.last_good

    def reduced(self, times: Floats) -> Floats:
        asked = np.asarray(times, dtype=float)
        y = self._known.reduced(np.minimum(asked, self._stop))
        later = asked > self._stop
        # one that fails within the window stays as it was last
        if later.any() and self.last_good >= self._stop:
            y = y.copy()
            y[later] = self._between(self._rate * (asked[later] - self._stop))
        return y

    def _between(self, frames: Floats) -> Floats:
        """(T, 6 + K) at (T,) frames after the end of the window, not whole ones."""
        index = np.floor(frames).astype(int)
        self._extend(int(index.max()) + 4)
        # the first of them is a frame before the end
        last, here, there, after = (np.stack([self._frames[i + k] for i in index]) for k in range(4))
        u = (frames - index)[:, None]
        start, end = 0.5 * (there - last), 0.5 * (after - here)
        bend = 2.0 * (here - there) + start + end
        return here + u * (start + u * (3.0 * (there - here) - 2.0 * start - end + u * bend))

    def _extend(self, count: int) -> None:
        if not self._frames:
            self._frames = list(self._known.reduced(self._stop - np.array([1.0, 0.0]) / self._rate))
        while len(self._frames) < count:
            before, now = (frame[None] for frame in self._frames[-2:])
            self._frames.append(self._dynamics.next(before, now, self._theta[None])[0])
