"""What all models of reduced coordinates share: a geometry in, its evaluated basis cached, a motion out."""

from abc import abstractmethod

from odeform.checkpoint import Checkpoint
from odeform.models.base import Predictor, check_finite
from odeform.motion.evaluated_basis import EvaluatedBasis, evaluate_basis
from odeform.motion.recent import Recent
from odeform.motion.reduced_motion import ReducedMotion, Trajectory
from odeform.motion.reduced_space import ReducedSpace
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, MotionSequence

__all__ = ["ReducedModel"]

CACHED = 4  # geometries (or azimuths) whose basis is kept


class ReducedModel(Predictor):
    """A predictor of reduced coordinates. Subclasses say how y(t) follows from the parameters."""

    def _read(self, checkpoint: Checkpoint) -> None:
        self.space = ReducedSpace.from_parts(checkpoint.config["space"], checkpoint.arrays, self.rest)
        self._evaluated: Recent[EvaluatedBasis] = Recent(CACHED)

    @abstractmethod
    def _trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        """y(t) for inputs theta (P,), solved at least to `until` seconds."""

    def evaluate_basis(self, geometry: Geometry, azimuth: float) -> EvaluatedBasis:
        """The basis on a geometry at an azimuth in radians; the last few are kept."""

        def evaluated() -> EvaluatedBasis:
            check_finite(geometry)
            return evaluate_basis(geometry, self.space, azimuth)

        # a basis holds its geometry, whose id therefore stays its own
        return self._evaluated.get((id(geometry), azimuth), evaluated)

    def _solve(
        self,
        geometry: Geometry,
        parameters: Parameters,
        settings: SolverSettings | None,
        until: float,
        observed: MotionSequence | None,
    ) -> ReducedMotion:
        evaluated = self.evaluate_basis(geometry, self.schema.azimuth(parameters))
        trajectory = self._trajectory(self.schema.inputs(parameters), evaluated, settings, until)
        return ReducedMotion(self.schema, parameters, geometry, self.space, evaluated, trajectory)
