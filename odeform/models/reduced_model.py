"""What all models of reduced coordinates share: a geometry in, its evaluated basis cached, a motion out."""

from abc import abstractmethod
from functools import cached_property

from odeform.checkpoint import Checkpoint
from odeform.models.base import Predictor, check_finite
from odeform.models.continuation import Dynamics, continued, has_continuation, without_continuation
from odeform.motion.body import WatchedBody, watched_body
from odeform.motion.evaluated_basis import EvaluatedBasis, evaluate_basis
from odeform.motion.recent import InUse
from odeform.motion.reduced_motion import ReducedMotion
from odeform.motion.reduced_space import ReducedSpace
from odeform.motion.trajectory import Adjusted, Trajectory
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, MotionSequence

__all__ = ["ReducedModel"]


class ReducedModel(Predictor):
    """A predictor of reduced coordinates. Subclasses say how y(t) follows from the parameters."""

    continues_itself: bool = False
    """Whether what a subclass solves for goes on beyond the trained window, without `dynamics`."""

    def __init__(self, checkpoint: Checkpoint) -> None:
        """Motions of a checkpoint whose continuation is of an earlier version stop where the trained window ends."""
        goes_on = self.continues_itself or has_continuation(checkpoint.arrays)
        super().__init__(checkpoint if goes_on else without_continuation(checkpoint))

    def _read(self, checkpoint: Checkpoint) -> None:
        _ = self.space, self.dynamics  # damaged ones are found now, not when they are used

    @cached_property
    def space(self) -> ReducedSpace:
        """That of its coordinates."""
        return ReducedSpace.from_parts(self.checkpoint.config["space"], self.checkpoint.arrays, self.rest)

    @cached_property
    def dynamics(self) -> Dynamics | None:
        """What continues motions beyond the trained window; None where they do so by themselves, or stop."""
        return Dynamics.from_arrays(self.checkpoint.arrays, self.space.coordinates, len(self.schema.learned))

    @cached_property
    def _evaluated(self) -> InUse[EvaluatedBasis]:
        return InUse()

    @abstractmethod
    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        """y(t) for inputs theta (P,), solved at least to `until` seconds, without `dynamics`."""

    def _continued(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        if self.dynamics is None:
            return self.trajectory(theta, evaluated, settings, until)
        window = self.schema.window
        solved = self.trajectory(theta, evaluated, settings, min(until, window.stop))
        return continued(solved, self.dynamics, theta, window)

    def evaluate_basis(self, geometry: Geometry, azimuth: float) -> EvaluatedBasis:
        """The basis on a geometry at an azimuth in radians; kept while a motion uses it, or until the next one."""

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
        trajectory = self._continued(self.schema.inputs(parameters), evaluated, settings, until)
        if self.space.rolling is not None:
            trajectory = Adjusted(trajectory, lambda _, y: self.space.with_modes(y))
        return ReducedMotion(
            self.schema, parameters, geometry, self.space, evaluated, trajectory, self.trust, self.watched_body
        )

    @cached_property
    def watched_body(self) -> WatchedBody:
        """The trained body, for the checks of motions."""
        limits = self.trust.limits
        lowest = float("-inf") if limits.floor is None else limits.floor - limits.depth
        return watched_body(self.rest, self.space, lowest)
