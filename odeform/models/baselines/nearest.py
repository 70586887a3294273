"""The training sequence with the nearest parameters: what any model has to beat."""

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.models.baselines.frame_trajectory import FrameTrajectory
from odeform.models.reduced_model import ReducedModel
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.reduced_space import POSE
from odeform.solver.integrate import SolverSettings
from odeform.types import Arrays, Floats

__all__ = ["Nearest", "fit_nearest"]


class Nearest(ReducedModel):
    """DisplayOptions up; does not learn."""

    model = "nearest"

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        self._times = checkpoint.arrays["times"]
        self._theta = checkpoint.arrays["theta"]
        self._pose, self._local = checkpoint.arrays["pose"], checkpoint.arrays["local"]

    def _trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, quality: SolverSettings | None, until: float
    ) -> FrameTrajectory:
        row = int(((self._theta - theta) ** 2).sum(axis=1).argmin())

        def frames() -> Floats:
            return np.concatenate([self._pose[row], self._local[row]], axis=1, dtype=float)

        return FrameTrajectory("nearest training sequence", self._times, frames)


def fit_nearest(data: TrainingData) -> tuple[Arrays, dict[str, object]]:
    """Arrays and settings of the checkpoint. Half precision leaves deformations of 5 mm right to 3 micrometres."""
    pose, local = np.split(data.reduced["train"], [POSE], axis=2)
    arrays = {"pose": pose.astype(np.float32), "local": local.astype(np.float16)}
    return {"times": data.times, "theta": data.theta["train"], **arrays}, {}
