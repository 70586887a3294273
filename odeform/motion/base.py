"""What every model's motion answers: any time in, poses and points out."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field

from odeform.schema import Parameters, Schema
from odeform.types import Frames, Geometry, Matrices, Points, Pose, Times

__all__ = ["Motion", "SolveStats"]


@dataclass(frozen=True)
class SolveStats:
    """How a trajectory came about."""

    solver: str
    steps: int
    evaluations: int
    rejected: int
    status: str
    wall_ms: float
    estimate: Callable[[], float | None] = field(repr=False, compare=False)

    @property
    def solver_error_mm(self) -> float | None:
        """Estimated error of the integration alone, not of the model. Made when first read: it costs about a solve."""
        return self.estimate()


class Motion(ABC):
    """P(t) = T(t) o D(t)(P0) of one geometry under one set of parameters (paper eq. 4).

    What it says of a time never depends on what was asked before. Lengths are metres, times seconds; points are in
    scene axes, float32.
    """

    schema: Schema
    parameters: Parameters
    geometry: Geometry

    @property
    @abstractmethod
    def stats(self) -> SolveStats: ...

    @property
    @abstractmethod
    def last_good(self) -> float:
        """Seconds up to which the motion is sound; later times show the state of that moment."""

    @abstractmethod
    def vertices(self, t: float | Times) -> Points | Frames:
        """(N, 3) float32 metres at time `t` in seconds; (T, N, 3) for (T,) times."""

    @abstractmethod
    def pose(self, t: float | Times) -> Pose:
        """T(t), the rigid part: (4, 4) in scene axes, metres; (T, 4, 4) for (T,) times. The identity at rest."""

    @abstractmethod
    def local(self, t: float | Times) -> Points | Frames:
        """D(t) - id, the deformation alone, in the frame of the body at rest: (N, 3) or (T, N, 3) metres."""

    @abstractmethod
    def deformed(self, t: float) -> Points:
        """D(t)(P0), the deformation alone where the body rests: (N, 3) float32 metres. `pose(t)` takes it on."""

    @abstractmethod
    def covariances(self, t: float) -> Matrices:
        """F S F^T, the covariances of splats at time `t`: (N, 3, 3) float32 m^2."""

    @abstractmethod
    def deformed_covariances(self, t: float) -> Matrices:
        """Covariances of splats under the deformation alone, where the body rests: to `deformed` as (N, 3, 3) m^2."""

    @abstractmethod
    def deformation_bound(self, time: float) -> float:
        """No point is displaced locally by more than this at `time`, in metres."""

    @abstractmethod
    def deformation_rms(self, times: Times) -> Times:
        """(T,) root-mean-square local displacement over the surface in metres."""

    @property
    def outside(self) -> tuple[str, ...]:
        """Names of the parameters beyond their trained range."""
        return self.schema.outside(self.parameters)

    def extrapolates(self, time: float) -> bool:
        """Whether `time` lies beyond the trained window."""
        return not self.schema.window.start <= time <= self.schema.window.stop + 1e-9
