"""Defines what the three families of ODeform have in common: a motion is a solved ODE, read out, and a residual."""

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.models.frontier import FrontierPoint
from odeform.models.reduced_model import ReducedModel
from odeform.models.residual import Residual
from odeform.models.solved import FINER, Problem, SolvedTrajectory
from odeform.models.solved_batch import BatchProblem, SolvedBatch
from odeform.motion.batch_trajectory import AdjustedBatch, BatchTrajectory
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.trajectory import Adjusted, Trajectory
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, Times

__all__ = ["Model"]


class Model(ReducedModel):
    """dz/dt = f(t, z; theta) from z(0; theta), read out as pose and deformation y(t, z; theta), plus a residual.

    A family says what `problem` is. What follows from it is the same for all: the solution with any settings of the
    solver, its error, the residual, and what continues the motion beyond the trained window.
    """

    fallback: ClassVar[SolverSettings | None] = None
    """Fixed steps that take over where adaptive ones fail; by default classical Runge-Kutta, once a frame."""
    finer: ClassVar[Mapping[SolverSettings, float]] = MappingProxyType(FINER)
    """Settings that solver errors are measured with, and the error in mm from which on each suffices."""
    residual: Residual | None = None

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        self._read_settings(checkpoint.config)

    def _read_settings(self, config: Mapping[str, Any]) -> None:
        """The settings of the solver."""
        self.qualities = {name: SolverSettings(**values) for name, values in config.get("qualities", {}).items()}
        self.frontier = tuple(FrontierPoint.from_json(row) for row in config.get("frontier", ()))

    @abstractmethod
    def problem(self, theta: Floats, evaluated: EvaluatedBasis, dtype: type = np.float64) -> Problem:
        """States the initial value problem for theta (P,) in [-1, 1] on a body: field, initial state, and readout."""

    def batch_problem(
        self, theta: Floats, geometry: Geometry, azimuths: Times, dtype: type
    ) -> Callable[[], BatchProblem]:
        """States what `problem` does for theta (B, P) and azimuths (B,) in radians; families that solve motions
        `together` are asked for it whenever later times are."""
        raise NotImplementedError

    def residual_inputs(self, theta: Floats) -> Any:
        """Returns what the residual is regressed on, for theta (P,) in [-1, 1], or (B, P): by default theta itself."""
        return theta

    def integrate(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings, until: float
    ) -> SolvedTrajectory:
        """Solves the ODE alone for theta (P,) in [-1, 1], to `until` seconds at least."""
        problem = self.problem(theta, evaluated, getattr(np, settings.dtype))
        return self._solved(problem, lambda: self.problem(theta, evaluated, np.float64), settings, until)

    def _solved(
        self, problem: Problem, precise: Callable[[], Problem], settings: SolverSettings, until: float
    ) -> SolvedTrajectory:
        frame, radius = 1.0 / self.schema.window.rate, self.space.gyration_radius
        fallback = self.fallback or SolverSettings("rk4", step=frame, dtype=settings.dtype)
        until = max(until, problem.begin + frame)
        return SolvedTrajectory(problem, settings, fallback, until, radius, precise, self.finer)

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        assert settings is not None
        solved = self.integrate(theta, evaluated, settings, until)
        if self.residual is None:
            return solved
        return Adjusted(solved, self.residual.adjustment(solved, self.residual_inputs(theta)))

    def batch_trajectory(
        self, geometry: Geometry, sets: Sequence[Parameters], settings: SolverSettings, until: float
    ) -> BatchTrajectory:
        theta, azimuths = self.batch_inputs(sets), np.array([self.schema.azimuth(each) for each in sets])
        make = self.batch_problem(theta, geometry, azimuths, getattr(np, settings.dtype))
        solved = SolvedBatch(make, settings, until, 1.0 / self.schema.window.rate)
        if self.residual is None:
            return solved
        return AdjustedBatch(solved, self.residual.adjustment(solved, self.residual_inputs(theta)))
