"""The training sequence with the nearest parameters: what any model has to beat."""

import numpy as np

from odeform.baselines.frames import FrameTrajectory
from odeform.checkpoint import Checkpoint
from odeform.model.base import ReducedModel
from odeform.model.data import TrainingData
from odeform.model.placed import PlacedBasis
from odeform.solver.integrate import Quality
from odeform.types import Arrays, Floats

__all__ = ["Nearest", "fit_nearest"]


class Nearest(ReducedModel):
    """Looks up; does not learn."""

    model = "nearest"

    def _read(self, checkpoint: Checkpoint) -> None:
        self._times = checkpoint.arrays["times"]
        self._theta = checkpoint.arrays["theta"]
        self._reduced = checkpoint.arrays["reduced"]

    def _trajectory(self, theta: Floats, placed: PlacedBasis, quality: Quality | None, until: float) -> FrameTrajectory:
        row = int(((self._theta - theta) ** 2).sum(axis=1).argmin())
        return FrameTrajectory("nearest training sequence", self._times, lambda: self._reduced[row])


def fit_nearest(data: TrainingData) -> tuple[Arrays, dict[str, object]]:
    """Arrays and settings of the checkpoint. Deformations are kept to single precision."""
    reduced = data.reduced["train"].astype(np.float32)
    return {"times": data.times, "theta": data.theta["train"], "reduced": reduced}, {}
