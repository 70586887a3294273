"""What all models of reduced motions share: geometry in, cached basis, motion out."""

from abc import abstractmethod
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.models.base import TrainedModel, check_finite
from odeform.motion.evaluated_basis import EvaluatedBasis, evaluate_basis
from odeform.motion.reduced_motion import ReducedMotion, Trajectory
from odeform.motion.reduced_space import ReducedSpace
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, MotionSequence

__all__ = ["ReducedModel"]

CACHED = 4  # geometries (or headings) whose basis is kept


class ReducedModel(TrainedModel):
    """A predictor of reduced coordinates. Subclasses say how y(t) comes from parameters."""

    def _read(self, checkpoint: Checkpoint) -> None:
        self.space = ReducedSpace.from_parts(checkpoint.config["space"], checkpoint.arrays, self.rest)
        self._evaluated: OrderedDict[tuple[int, float], tuple[Geometry, EvaluatedBasis]] = OrderedDict()

    @abstractmethod
    def _trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, quality: SolverSettings | None, until: float
    ) -> Trajectory: ...

    def evaluate_basis(self, geometry: Geometry, azimuth: float) -> EvaluatedBasis:
        """The basis on a geometry; kept for the last few."""
        key = (id(geometry), azimuth)
        if key not in self._evaluated:
            check_finite(geometry)
            self._evaluated[key] = (geometry, evaluate_basis(geometry, self.space, azimuth))
            if len(self._evaluated) > CACHED:
                self._evaluated.popitem(last=False)
        self._evaluated.move_to_end(key)
        return self._evaluated[key][1]

    def solve(
        self,
        geometry: Geometry | None = None,
        parameters: Mapping[str, Any] | None = None,
        quality: str | SolverSettings = "balanced",
        until: float | None = None,
        observed: MotionSequence | None = None,
    ) -> ReducedMotion:
        shape = self._shape(geometry, observed)
        complete: Parameters = self.schema.complete(parameters)
        evaluated = self.evaluate_basis(shape, self.schema.azimuth(complete))
        window = self.schema.window
        span = float(window.soft_clamped(np.array(window.stop if until is None else until)))
        trajectory = self._trajectory(self.schema.inputs(complete), evaluated, self._quality(quality), span)
        return ReducedMotion(self.schema, complete, shape, self.space, evaluated, trajectory)
