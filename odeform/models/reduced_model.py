"""Defines models of reduced coordinates: a geometry goes in, its evaluated basis is cached, a motion comes out."""

from abc import abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.models.base import Predictor, check_finite
from odeform.models.continuation import (
    Dynamics,
    continued,
    continued_batch,
    has_continuation,
    without_continuation,
)
from odeform.models.solve import solved
from odeform.motion.base import Motion
from odeform.motion.batch_trajectory import AdjustedBatch, BatchTrajectory
from odeform.motion.body import CheckedBody, checked_body
from odeform.motion.evaluated_basis import EvaluatedBasis, evaluate_basis
from odeform.motion.ground import Ground
from odeform.motion.motion_batch import MotionBatch
from odeform.motion.recent import InUse, geometry_key
from odeform.motion.reduced_batch import BatchPart, ReducedBatch
from odeform.motion.reduced_motion import ReducedMotion
from odeform.motion.reduced_space import ReducedSpace
from odeform.motion.trajectory import Shown, Trajectory
from odeform.schema import BEYOND, Parameters, soft_clip
from odeform.solver.batch_steps import can_batch
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, MotionSequence, Times

__all__ = ["ReducedModel"]


class ReducedModel(Predictor):
    """A predictor of reduced coordinates. Subclasses say how y(t) follows from the parameters."""

    together: int = 0
    """How many motions are solved at once, as many as need a few tens of megabytes; 0: one by one."""
    reach: ClassVar[tuple[float, float]] = (1.0, BEYOND)
    """Half trained ranges up to which inputs are as they are asked for, and how far they go beyond."""
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
        """Reads the space of its coordinates."""
        return ReducedSpace.from_parts(self.checkpoint.config["space"], self.checkpoint.arrays, self.rest)

    @cached_property
    def dynamics(self) -> Dynamics | None:
        """Reads what continues motions beyond the trained window; None where they do so by themselves, or stop."""
        return Dynamics.from_arrays(self.checkpoint.arrays, self.space.coordinates, len(self.schema.learned))

    @cached_property
    def _evaluated(self) -> InUse[EvaluatedBasis]:
        return InUse()

    @abstractmethod
    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        """Solves y(t) for inputs theta (P,), solved at least to `until` seconds, without `dynamics`."""

    def _continued(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        if self.dynamics is None:
            return self.trajectory(theta, evaluated, settings, until)
        window = self.schema.window
        solved = self.trajectory(theta, evaluated, settings, min(until, window.stop))
        return continued(solved, self.dynamics, theta, window)

    def inputs(self, parameters: Parameters) -> Floats:
        """Computes (P,) normalised parameters, soft-clipped by `reach`."""
        return self.batch_inputs([parameters])[0]

    def batch_inputs(self, sets: Sequence[Parameters]) -> Floats:
        """(B, P) `inputs` of B sets of parameters."""
        return soft_clip(np.stack([self.schema.vector(parameters) for parameters in sets]), *self.reach)

    def evaluate_basis(self, geometry: Geometry, azimuth: float) -> EvaluatedBasis:
        """The basis on a geometry at an azimuth in radians; kept while a motion uses it, or until the next one."""

        def evaluated() -> EvaluatedBasis:
            check_finite(geometry)
            return evaluate_basis(geometry, self.space, azimuth)

        # a basis holds its geometry, whose id therefore stays its own
        return self._evaluated.get((geometry_key(geometry), azimuth), evaluated)

    def _solve(
        self,
        geometry: Geometry,
        parameters: Parameters,
        settings: SolverSettings | None,
        until: float,
        observed: MotionSequence | None,
    ) -> Motion:
        evaluated = self.evaluate_basis(geometry, self.schema.azimuth(parameters))
        trajectory = self._continued(self.inputs(parameters), evaluated, settings, until)
        shown = Shown(trajectory, self.to_body)
        valid, body, ground = self.validity, self.checked_body, self.ground_of(parameters)
        return ReducedMotion(self.schema, parameters, geometry, self.space, evaluated, shown, valid, body, ground)

    def ground_of(self, parameters: Parameters) -> Ground | None:
        """What a motion under these parameters is kept out of where it is shown; None: it is as it was solved."""
        return None

    def to_body(self, times: Times, y: Floats) -> Float[np.ndarray, "*batch times body_y"]:
        """Returns what is shown at (T,) s, (..., T, 6 + K), for predictions (..., T, 6 + S)."""
        if self.space.rolling is None:
            return y
        return self.space.with_modes(y.reshape(-1, y.shape[-1])).reshape(*y.shape[:-1], -1)

    def batch_trajectory(
        self, geometry: Geometry, sets: Sequence[Parameters], settings: SolverSettings, until: float
    ) -> BatchTrajectory:
        """y(t) under each of B sets of parameters, solved at least to `until` seconds, without `dynamics`; asked of
        models that solve motions `together`."""
        raise NotImplementedError

    def _solve_batch(
        self, geometry: Geometry, sets: list[dict[str, Any]], settings: SolverSettings | None, until: float
    ) -> MotionBatch:
        if not self.together or settings is None or not can_batch(settings):
            return super()._solve_batch(geometry, sets, settings, until)
        given, limits, window = settings, self.validity.limits, self.schema.window

        def part(some: Sequence[Parameters]) -> BatchPart:
            azimuths = np.array([self.schema.azimuth(each) for each in some])
            trajectory = self._continued_batch(geometry, some, given, until)
            grounds = [self.ground_of(each) for each in some]
            return BatchPart(trajectory, self.checked_body, limits, window, azimuths, grounds)

        parts = [part(sets[first : first + self.together]) for first in range(0, len(sets), self.together)]
        return ReducedBatch(
            sets,
            lambda index: solved(self, geometry, sets[index], settings, until),
            window,
            parts,
            lambda azimuth: self.evaluate_basis(geometry, azimuth),
            [self.ground_of(each) for each in sets],
        )

    def _continued_batch(
        self, geometry: Geometry, sets: Sequence[Parameters], settings: SolverSettings, until: float
    ) -> BatchTrajectory:
        if self.dynamics is None:
            trajectory = self.batch_trajectory(geometry, sets, settings, until)
        else:
            window = self.schema.window
            known = self.batch_trajectory(geometry, sets, settings, min(until, window.stop))
            trajectory = continued_batch(known, self.dynamics, self.batch_inputs(sets), window)
        return AdjustedBatch(trajectory, self.to_body)

    @cached_property
    def checked_body(self) -> CheckedBody:
        """The trained body, for the checks of motions."""
        limits = self.validity.limits
        lowest = float("-inf") if limits.floor is None else limits.floor - limits.depth
        return checked_body(self.rest, self.space, lowest)
