"""POD of whole trajectories: what classical reduced-order models interpolate over the parameters."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.arrays import in_steps, row_steps
from odeform.dataset.training_data import ROUNDING, TrainingData
from odeform.motion.reduced_space import POSE, ReducedSpace
from odeform.types import Arrays, Floats

__all__ = ["TrajectoryPod", "fit_trajectory_pod", "trajectory_weight"]

ENERGY = 0.999999999  # less limits the best fits: at 0.999999 the deformation error of `gp` on the drop is 10 %, not 4


@dataclass(frozen=True, eq=False)
class TrajectoryPod:
    """Trajectories (T, 6 + K), flat, as `mean` + coefficients @ `modes`; all in m, rotations scaled by `weight`."""

    weight: Float[np.ndarray, " y"]
    """(6 + K,) metres of displacement per unit of each coordinate."""
    mean: Float[np.ndarray, " entries"]
    modes: Float[np.ndarray, "modes entries"]
    coefficients: Float[np.ndarray, "sequences modes"]
    """Coefficients of the training motions; the modes are orthonormal."""

    def project(self, reduced: Floats) -> Float[np.ndarray, "sequences modes"]:
        """Returns the coefficients of trajectories (S, T, 6 + K)."""
        return ((reduced * self.weight).reshape(len(reduced), -1) - self.mean) @ self.modes.T

    def error(self, coefficients: Floats, reduced: Floats) -> float:
        """Returns the RMS distance in m between (S, modes) `coefficients` and trajectories (S, T, 6 + K), over the
        sequences."""
        target = (reduced * self.weight).reshape(len(reduced), -1)
        return float(np.sqrt(((self.mean + coefficients @ self.modes - target) ** 2).sum(axis=1).mean()))

    def arrays(self) -> Arrays:
        """Returns the mean and modes, in the units of the coordinates, and the coefficients, for a checkpoint."""
        unweight = np.tile(1.0 / self.weight, len(self.mean) // len(self.weight))
        sizes = np.sqrt((self.coefficients**2).mean(axis=0))
        # a displacement is the sum of all coordinates of a frame, over three axes
        steps = row_steps(sizes, ROUNDING * np.sqrt(3.0 / len(self.weight)))
        return {
            "pod.mean": (self.mean * unweight).astype(np.float64),
            **in_steps("pod.modes", self.modes * unweight, steps),
            **in_steps("pod.coefficients", self.coefficients, np.full(len(self.coefficients), ROUNDING)),
        }


def trajectory_weight(space: ReducedSpace) -> Float[np.ndarray, " y"]:
    """Returns (6 + K,) metres of displacement per unit of each coordinate."""
    weight = np.ones(space.coordinates)
    weight[3:POSE] = space.gyration_radius * np.sqrt(2.0 / 3.0)
    return weight


def fit_trajectory_pod(data: TrainingData) -> TrajectoryPod:
    """The leading modes of the training motions, which hold `ENERGY` of their variance."""
    train = data.reduced["train"]
    weight = trajectory_weight(data.space)
    flat = (train * weight).reshape(len(train), -1)
    mean = flat.mean(axis=0)
    u, s, vt = np.linalg.svd(flat - mean, full_matrices=False)
    count = int(np.searchsorted(np.cumsum(s**2) / (s**2).sum(), ENERGY)) + 1
    return TrajectoryPod(weight, mean, vt[:count], u[:, :count] * s[:count])
