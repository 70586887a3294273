"""What all models that come from a checkpoint share: reading it, and what they check before they solve."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.models.error_band import ErrorBand
from odeform.models.frontier import FrontierPoint
from odeform.motion.base import Motion
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, Mesh, MotionSequence, Times

__all__ = ["TrainedModel", "check_finite"]


def check_finite(geometry: Geometry) -> None:
    """`InputError` for a shape that cannot be moved."""
    if not np.isfinite(geometry.points).all() or len(geometry.points) == 0:
        raise InputError("geometry: expected at least one point, all finite")


class TrainedModel(ABC):
    """A predictor of one scene."""

    model: str
    qualities: Mapping[str, SolverSettings] = {}
    """Ways to integrate, by name; empty for models that leave no choice."""
    frontier: tuple[FrontierPoint, ...] = ()
    """The ways to choose from, cheap to fine; empty for models that leave none, and in older checkpoints."""
    rescales_input: bool = True
    extrapolates: bool = True

    def __init__(self, checkpoint: Checkpoint) -> None:
        try:
            self.checkpoint = checkpoint
            self.schema = checkpoint.schema
            self.rest = Mesh(checkpoint.arrays["rest.points"], checkpoint.arrays["rest.faces"])
            self._expected = ErrorBand(checkpoint.arrays) if "val.theta" in checkpoint.arrays else None
            self._read(checkpoint)
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise InputError(f"checkpoint of {checkpoint.model}: missing or wrong {error}") from None

    @abstractmethod
    def _read(self, checkpoint: Checkpoint) -> None:
        """Take what this model needs; KeyError where it is missing."""

    @abstractmethod
    def solve(
        self,
        geometry: Geometry | None = None,
        parameters: Mapping[str, Any] | None = None,
        quality: str | SolverSettings = "balanced",
        until: float | None = None,
        observed: MotionSequence | None = None,
    ) -> Motion:
        """The motion of `geometry` (default: the body the model was trained on) under `parameters`.

        The geometry lies in the scene as at rest. Integrates to `until` seconds (default: the trained window); the
        motion can be asked beyond and then goes on. Beyond what was trained motions fade: models see parameters and
        times that `Schema.inputs` and `Window.soft_clamped` bound.
        """

    def error_band(self, parameters: Parameters, times: Times) -> Floats | None:
        """(T, 2) mm RMSE at (T,) seconds, which half and nine in ten of unseen motions of the trained body keep to.

        None where the checkpoint knows nothing of validation.
        """
        return None if self._expected is None else self._expected.at(self.schema.vector(parameters), times)

    def to_body_frame(self, geometry: Geometry, parameters: Mapping[str, Any]) -> Geometry:
        """As it is: `solve` expects bodies where they lie in the scene."""
        return geometry

    def _shape(self, geometry: Geometry | None, observed: MotionSequence | None) -> Geometry:
        """The shape to move. `InputError` where observations are given that have no use, or lack that are needed."""
        if observed is not None and not self.schema.needs_observations:
            raise InputError(f"{self.model}: predicts from parameters alone and takes no observed frames")
        if observed is None and self.schema.needs_observations:
            raise InputError(f"{self.model}: moves between observed frames, and none were given")
        return self.rest if geometry is None else geometry

    def _quality(self, quality: str | SolverSettings) -> SolverSettings | None:
        """How to integrate; None for models without a choice, whatever is asked of them."""
        if not self.qualities or isinstance(quality, SolverSettings):
            return quality if isinstance(quality, SolverSettings) else None
        if quality not in self.qualities:
            raise InputError(f"unknown quality {quality!r}: expected one of {', '.join(self.qualities)}")
        return self.qualities[quality]
