"""Kernel ridge regression over the parameters: the posterior mean of a Gaussian process, and a strong rival.

Matern 5/2 kernel with a length scale for each parameter (Rasmussen and Williams 2006, 4.2 and 2.2), on the POD
coefficients of whole trajectories. Length scales and ridge minimise the error on validation.
"""

from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.models.baselines.fitted_model import FittedModel
from odeform.models.baselines.frame_trajectory import FrameTrajectory
from odeform.models.baselines.trajectory_pod import fit_trajectory_pod
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.solver.integrate import SolverSettings
from odeform.types import Arrays, Floats

__all__ = ["GaussianProcess", "matern"]

STARTS = (0.5, 2.0, 8.0)  # length scales that the search starts from; the trained range is 2 long
RIDGE = 1e-6  # where it starts, relative to the kernel's value at distance 0
EVALUATIONS = 150  # of the validation error, from each start
BOUNDS = ((np.log(0.05), np.log(200.0)), (np.log(1e-12), 0.0))  # of length scales and ridge, in logarithms


def matern(
    one: Float[np.ndarray, "rows parameters"], other: Float[np.ndarray, "columns parameters"]
) -> Float[np.ndarray, "rows columns"]:
    """(1 + r + r^2 / 3) exp(-r), r = sqrt(5) times the distance of inputs that are divided by their length scales."""
    squares = (one**2).sum(axis=1)[:, None] + (other**2).sum(axis=1) - 2.0 * one @ other.T
    r = np.sqrt(5.0 * np.maximum(squares, 0.0))
    return (1.0 + r + r**2 / 3.0) * np.exp(-r)


class GaussianProcess(FittedModel):
    """Regresses trajectories on the parameters; a cubic spline in time; holds its last frame beyond the window."""

    model = "gp"

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        arrays = checkpoint.arrays
        self._times, self._mean, self._modes = arrays["times"], arrays["pod.mean"], arrays["pod.modes"]
        self._scales = np.array(checkpoint.config["length_scales"], dtype=float)
        self._inputs, self._weights = arrays["theta"] / self._scales, arrays["gp.weights"]

    @staticmethod
    def fit(data: TrainingData) -> tuple[Arrays, dict[str, Any]]:
        """Length scales and ridge by Nelder-Mead on the RMS displacement on validation, from several starts."""
        pod = fit_trajectory_pod(data)
        train, val = data.theta["train"], data.theta["val"]

        def weights(settings: Floats) -> Floats:
            scales, ridge = np.exp(settings[:-1]), np.exp(settings[-1])
            kernel = matern(train / scales, train / scales) + ridge * np.eye(len(train))
            return cho_solve(cho_factor(kernel), pod.coefficients)

        def error(settings: Floats) -> float:
            scales = np.exp(settings[:-1])
            try:
                predicted = matern(val / scales, train / scales) @ weights(settings)
            except np.linalg.LinAlgError:
                return float("inf")  # the kernel matrix is singular to rounding
            return pod.error(predicted, data.reduced["val"])

        length, ridge = BOUNDS
        bounds = [*[length] * train.shape[1], ridge]
        starts = [np.log([*[scale] * train.shape[1], RIDGE]) for scale in STARTS]
        limits = {"maxfev": EVALUATIONS, "xatol": 1e-2, "fatol": 1e-9}
        found = [minimize(error, start, method="Nelder-Mead", bounds=bounds, options=limits) for start in starts]
        best = min(found, key=lambda trial: trial.fun)
        arrays = {"times": data.times, "theta": train, "gp.weights": weights(best.x), **pod.arrays()}
        trials = [{**_named(trial.x), "val": trial.fun} for trial in found]
        return arrays, {**_named(best.x), "modes": len(pod.modes), "trials": trials}

    def _trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> FrameTrajectory:
        def predict() -> Floats:
            coefficients = matern(theta[None] / self._scales, self._inputs)[0] @ self._weights
            return (self._mean + coefficients @ self._modes).reshape(len(self._times), -1)

        return FrameTrajectory("kernel ridge regression", self._times, predict)


def _named(settings: Floats) -> dict[str, Any]:
    """Length scales and ridge from their logarithms, as a checkpoint holds them."""
    return {"length_scales": np.exp(settings[:-1]).tolist(), "ridge": float(np.exp(settings[-1]))}
