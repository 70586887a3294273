"""POD of whole trajectories, and radial-basis interpolation of its coefficients over the parameters.

The classical reduced-order model (Audouze, De Vuyst & Nair 2009). It uses the same decomposition as ODeform: pose and
deformation in the canonical frame, so that the azimuth is no parameter to learn.
"""

import itertools
from typing import Any

import numpy as np
from scipy.interpolate import RBFInterpolator

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.errors import InputError
from odeform.models.baselines.fitted_model import FittedModel
from odeform.models.baselines.frame_trajectory import FrameTrajectory
from odeform.models.baselines.trajectory_pod import fit_trajectory_pod
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.solver.integrate import SolverSettings
from odeform.types import Arrays, Floats

__all__ = ["PodRbf"]

KERNELS = ("linear", "thin_plate_spline", "cubic", "quintic")
SMOOTHINGS = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)


class PodRbf(FittedModel):
    """Interpolates trajectories over the parameters; a cubic spline in time; holds its last frame beyond the window."""

    model = "pod-rbf"

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        arrays, config = checkpoint.arrays, checkpoint.config
        self._times, self._mean, self._basis = arrays["times"], arrays["pod.mean"], arrays["pod.modes"]
        smoothing = float(config["smoothing"])
        if not 0.0 <= smoothing < np.inf:
            raise ValueError(f"smoothing: expected a finite number of 0 or more, got {smoothing:g}")
        self._check_inputs(arrays["theta"])
        self._interpolate = RBFInterpolator(
            arrays["theta"].astype(float),
            arrays["pod.coefficients"].astype(float),
            kernel=config["kernel"],
            smoothing=smoothing,
        )

    @staticmethod
    def fit(data: TrainingData) -> tuple[Arrays, dict[str, Any]]:
        """Fits modes to the training motions; the kernel and smoothing with the smallest RMS displacement on
        validation."""
        pod = fit_trajectory_pod(data)

        def error(kernel: str, smoothing: float) -> float:
            try:
                model = RBFInterpolator(data.theta["train"], pod.coefficients, kernel=kernel, smoothing=smoothing)
            except (ValueError, np.linalg.LinAlgError):
                return float("inf")  # too few sequences for the polynomial that goes with this kernel
            return pod.error(model(data.theta["val"]), data.reduced["val"])

        candidates = list(itertools.product(KERNELS, SMOOTHINGS))
        errors = [error(kernel, smoothing) for kernel, smoothing in candidates]
        if not np.isfinite(min(errors)):
            raise InputError(f"pod-rbf: {len(data.theta['train'])} training sequences are too few for any kernel")
        kernel, smoothing = candidates[int(np.argmin(errors))]
        arrays = {"times": data.times, "theta": data.theta["train"], **pod.arrays()}
        trials = [{"kernel": k, "smoothing": g, "val": e} for (k, g), e in zip(candidates, errors, strict=True)]
        return arrays, {"kernel": kernel, "smoothing": smoothing, "modes": len(pod.modes), "trials": trials}

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> FrameTrajectory:
        def predict() -> Floats:
            flat = self._mean + self._interpolate(theta[None])[0] @ self._basis
            return flat.reshape(len(self._times), -1)

        return FrameTrajectory("POD + RBF", self._times, predict)
