"""Kernel ridge regression over the parameters: the posterior mean of a Gaussian process, and a strong rival.

Matern kernel with a length scale for each parameter (Rasmussen and Williams 2006, 4.2 and 2.2), on the POD coefficients
of whole trajectories. Length scales, ridge and order minimise the error on validation and the leave-one-out error on
training together. In scenes with a contact and a force it works in the contact's frame
(`odeform.models.contact.regression`).
"""

from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.models.baselines.fitted_model import FittedModel
from odeform.models.baselines.frame_trajectory import FrameTrajectory
from odeform.models.baselines.trajectory_pod import fit_trajectory_pod
from odeform.models.contact.inputs import contact_inputs, has_contact
from odeform.models.contact.regression import ContactRegression, fit_contact_regression
from odeform.models.kernels.regression import Kernel, KernelRegression
from odeform.models.kernels.ridge import ORDERS, Ridge, search_ridge
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.solver.integrate import SolverSettings
from odeform.types import Arrays, Floats

__all__ = ["GaussianProcess"]


class GaussianProcess(FittedModel):
    """Regresses trajectories on the parameters; a cubic spline in time; holds its last frame beyond the window."""

    model = "gp"

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        arrays = checkpoint.arrays
        self._contact = ContactRegression(arrays, checkpoint.config) if "blend" in checkpoint.config else None
        if self._contact is not None:
            self._times = arrays["times"]
            return
        self._times, self._mean, self._modes = arrays["times"], arrays["pod.mean"], arrays["pod.modes"]
        scales = np.array(checkpoint.config["length_scales"], dtype=float)
        count = len(self.schema.learned)
        if scales.shape != (count,) or not (np.isfinite(scales) & (scales > 0.0)).all():
            raise ValueError(f"length_scales: expected {count} positive numbers, got {scales}")
        order = checkpoint.config.get("order", ORDERS[0])
        if order not in ORDERS:
            raise ValueError(f"order: expected one of {', '.join(map(str, ORDERS))}, got {order!r}")
        self._check_inputs(arrays["theta"])
        self._regression = _regression(checkpoint, Kernel(scales, order))

    @staticmethod
    def fit(data: TrainingData) -> tuple[Arrays, dict[str, Any]]:
        """Length scales and ridge by Nelder-Mead, from several starts, and the order of the kernel."""
        if has_contact(data.schema):
            known, asked = (contact_inputs(data.schema, data.theta[split], data.space) for split in ("train", "val"))
            return fit_contact_regression(known, asked, data.times, data.reduced["train"], data.reduced["val"])
        pod, theta = fit_trajectory_pod(data), data.theta
        val = (theta["val"], pod.project(data.reduced["val"]))
        found = search_ridge(theta["train"], pod.coefficients, val, orders=ORDERS)
        arrays = {"times": data.times, "theta": theta["train"], **pod.arrays()}
        trials = [{**_named(trial), "error": trial.error} for trial in found]
        return arrays, {**_named(found[0]), "modes": len(pod.modes), "trials": trials}

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> FrameTrajectory:
        def predict() -> Floats:
            if self._contact is not None:
                return self._contact.predict(contact_inputs(self.schema, theta[None], self.space))[0]
            return (self._mean + self._regression(theta[None])[0] @ self._modes).reshape(len(self._times), -1)

        return FrameTrajectory("kernel ridge regression", self._times, predict)


def _regression(checkpoint: Checkpoint, kernel: Kernel) -> KernelRegression:
    """The regression of the coefficients, whose weights are solved for; older checkpoints hold them."""
    arrays = checkpoint.arrays
    if "gp.weights" in arrays:
        return KernelRegression(kernel, arrays["theta"], arrays["gp.weights"])
    ridge = Ridge(kernel, float(checkpoint.config["ridge"]))
    return ridge.fit(arrays["theta"], arrays["pod.coefficients"].astype(float))


def _named(ridge: Ridge) -> dict[str, Any]:
    """The settings as a checkpoint holds them."""
    return {"length_scales": ridge.kernel.scales.tolist(), "ridge": ridge.ridge, "order": ridge.kernel.order}
