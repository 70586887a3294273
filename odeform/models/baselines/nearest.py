"""The training sequence with the nearest parameters: the least that any model has to beat."""

from typing import Any

import numpy as np

from odeform.arrays import in_steps
from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import ROUNDING, TrainingData
from odeform.models.baselines.fitted_model import FittedModel
from odeform.models.baselines.frame_trajectory import FrameTrajectory
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.reduced_space import POSE
from odeform.solver.integrate import SolverSettings
from odeform.types import Arrays, Floats

__all__ = ["Nearest"]


class Nearest(FittedModel):
    """Looks motions up and does not learn."""

    model = "nearest"

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        self._times = checkpoint.arrays["times"]
        self._theta = checkpoint.arrays["theta"]
        self._pose, self._local = checkpoint.arrays["pose"], checkpoint.arrays["local"]

    @staticmethod
    def fit(data: TrainingData) -> tuple[Arrays, dict[str, Any]]:
        """Keeps the training motions."""
        pose, local = np.split(data.reduced["train"], [POSE], axis=2)
        steps = np.full(len(pose), ROUNDING)
        arrays = {**in_steps("pose", pose, steps), **in_steps("local", local, steps)}
        return {"times": data.times, "theta": data.theta["train"], **arrays}, {}

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> FrameTrajectory:
        row = int(((self._theta - theta) ** 2).sum(axis=1).argmin())

        def frames() -> Floats:
            return np.concatenate([self._pose[row], self._local[row]], axis=1, dtype=float)

        return FrameTrajectory("nearest training sequence", self._times, frames)
