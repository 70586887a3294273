"""A motion: a time in, points and poses out."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field

from odeform.schema import Parameters, Schema
from odeform.types import Frames, Geometry, Matrices, Points, Pose, Times

__all__ = ["Motion", "SolveStats"]


@dataclass(frozen=True)
class SolveStats:
    """How a motion was computed.

    Attributes:
        solver: Its name, with the step or tolerance.
        steps: Number of steps taken.
        evaluations: Number of evaluations of the ODE's right-hand side.
        rejected: Number of steps repeated with a smaller step size.
        status: "ok", or why the integration ended early.
        wall_ms: Elapsed time in milliseconds.
        estimate: Computes `solver_error_mm`.
    """

    solver: str
    steps: int
    evaluations: int
    rejected: int
    status: str
    wall_ms: float
    estimate: Callable[[], float | None] = field(repr=False, compare=False)

    @property
    def solver_error_mm(self) -> float | None:
        """Estimated error of the integration in millimetres, without the error of the model.

        None where nothing is integrated. Computed on first access, which costs about one solve.
        """
        return self.estimate()


class Motion(ABC):
    """The motion of one geometry under one set of parameters: P(t) = T(t) o D(t)(P0), Eq. 4 of arXiv:2607.20670.

    A rigid motion T follows a local deformation D of the N points P0. Any time can be evaluated, in any order; the
    result does not depend on earlier calls. Points are in scene axes.

    Attributes:
        schema: That of the predictor.
        parameters: All of them, by name.
        geometry: The shape at rest.

    Examples:
        >>> import odeform
        >>> motion = odeform.load("kick").solve(parameters={"mass": 0.6, "force": 140.0})
        >>> motion.vertices(0.02).shape  # N points at one time
        (2306, 3)
        >>> import numpy as np
        >>> motion.vertices(np.array([0.0, 0.5])).shape
        (2, 2306, 3)
        >>> motion.pose(0.02).shape, motion.local(0.02).shape
        ((4, 4), (2306, 3))
        >>> motion.stats.status
        'ok'
    """

    schema: Schema
    parameters: Parameters
    geometry: Geometry

    @property
    @abstractmethod
    def stats(self) -> SolveStats:
        """Solver, evaluations, elapsed time, status and solver error."""

    @property
    @abstractmethod
    def last_good(self) -> float:
        """Seconds up to which the integration succeeded. Later times return the state at this time."""

    @abstractmethod
    def vertices(self, t: float | Times) -> Points | Frames:
        """(N, 3) float32 metres at time `t` in seconds; (T, N, 3) for (T,) times."""

    @abstractmethod
    def pose(self, t: float | Times) -> Pose:
        """T(t), the rigid part: (4, 4) in scene axes, metres; (T, 4, 4) for (T,) seconds. The identity at rest."""

    @abstractmethod
    def local(self, t: float | Times) -> Points | Frames:
        """D(t)(P0) - P0, the local displacement in the frame of the body at rest: (N, 3) or (T, N, 3) metres."""

    @abstractmethod
    def deformed(self, t: float) -> Points:
        """D(t)(P0), the deformed body before the rigid motion `pose(t)`: (N, 3) float32 metres."""

    @abstractmethod
    def covariances(self, t: float) -> Matrices:
        """Covariances of splats at `t` seconds: F S F^T, F the deformation gradient; (N, 3, 3) float32 m^2."""

    @abstractmethod
    def deformed_covariances(self, t: float) -> Matrices:
        """Covariances of splats before the rigid motion, those of `deformed(t)`: (N, 3, 3) m^2."""

    @abstractmethod
    def deformation_bound(self, time: float) -> float:
        """An upper bound on the local displacement of every point at `time` seconds, in metres."""

    @abstractmethod
    def deformation_rms(self, times: Times) -> Times:
        """(T,) root-mean-square local displacement over the surface in metres, at (T,) seconds."""

    @property
    def outside(self) -> tuple[str, ...]:
        """Names of the parameters outside their trained range."""
        return self.schema.outside(self.parameters)

    def extrapolates(self, time: float) -> bool:
        """Whether `time` in seconds lies outside the trained window."""
        return not self.schema.window.start <= time <= self.schema.window.stop + 1e-9
