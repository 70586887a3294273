"""What a user requests and what is then displayed: plain values, passed between session, presenter and panels."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from odeform.motion.base import Motion, SolveStats
from odeform.motion.recorded import RecordedMotion
from odeform.schema import REACH as CONTINUED
from odeform.types import Floats, Geometry, Perpoint, Times, Vector
from odeform_viz.columns import Column

__all__ = [
    "INVISIBLE",
    "REACH",
    "ColumnFrame",
    "Curves",
    "Description",
    "DisplayOptions",
    "Error",
    "Frame",
    "ViewRequest",
    "same_motions",
]

INVISIBLE = 1e-4  # m; a third of a pixel for a body of 0.1 m that is 720 pixels high
FLOOR_TOLERANCE = 5e-3  # m; the simulator's own contacts let a body sink in by up to 3 mm
REACH = 1.0 + CONTINUED  # length of the time slider in trained windows: as far as models continue


@dataclass(frozen=True)
class ViewRequest:
    """Everything that decides what is computed for one frame; `time` in seconds, `parameters` in the schema's units."""

    parameters: Mapping[str, float]
    time: float
    quality: str
    """Settings of all integrations: a name such as "balanced", or `SolverSettings` as JSON."""
    columns: tuple[Column, ...]


@dataclass(frozen=True)
class DisplayOptions:
    """How columns are drawn: overlaid or in a row, with errors as colours, with the camera following the body."""

    overlay: bool = False
    error_colors: bool = True
    follow: bool = True


@dataclass(frozen=True, eq=False)
class Error:
    """Distance of a prediction from the truth at one time: `distances` (N,) in metres at the truth's vertices."""

    distances: Perpoint
    rmse_mm: float
    """Over all coordinates, as is `mae_mm`."""
    mae_mm: float
    worst_vertex: int
    worst_position: Vector
    """(3,) metres: where the truth has the worst vertex."""

    @property
    def worst_mm(self) -> float:
        """The largest distance, in millimetres."""
        return 1e3 * float(self.distances[self.worst_vertex])


@dataclass(frozen=True, eq=False)
class ColumnFrame:
    """One column at one time: a rigid `pose` (4, 4) and the body that it moves.

    `points` (N, 3) in metres is the deformed body before the pose is applied, `covariances` (N, 3, 3) in m^2 those of
    its Gaussian splats, if any. Both are None where the deformation is too small to be visible. `depth` is how far the
    body is below the floor, in metres. `error` is None without a truth of the same parameters.
    """

    column: Column
    motion: Motion | RecordedMotion
    points: Floats | None
    covariances: Floats | None
    pose: Floats
    depth: float
    error: Error | None

    @property
    def stats(self) -> SolveStats:
        """Those of the motion."""
        return self.motion.stats

    @property
    def below_floor(self) -> bool:
        """Whether the body is visibly below the floor: deeper than `FLOOR_TOLERANCE`."""
        return self.depth > FLOOR_TOLERANCE


@dataclass(frozen=True, eq=False)
class Frame:
    """All visible columns at one time, in the order of the request.

    `refused` holds the reasons of columns that cannot be computed, `pending` the labels of those still to come.
    """

    request: ViewRequest
    columns: tuple[ColumnFrame, ...]
    refused: tuple[str, ...] = ()
    pending: tuple[str, ...] = ()

    def differs_in_time_only(self, request: ViewRequest) -> bool:
        """Whether `request` equals this frame's request but for the time."""
        return replace(request, time=self.request.time) == self.request

    @cached_property
    def truth(self) -> ColumnFrame | None:
        """The column of the recorded sequence; None if it is not among them."""
        return next((c for c in self.columns if c.column.truth), None)

    @cached_property
    def still(self) -> Geometry | None:
        """The part of the loaded shape that does not move; one for all columns."""
        fits = (c.column.fit for c in self.columns if c.column.fit)
        return next((fit.static for fit in fits if fit.static), None)

    @property
    def off_truth(self) -> bool:
        """Whether there is a truth, but of other parameters than the sliders'."""
        truth = self.truth.column.truth if self.truth else None
        return truth is not None and not truth.of(self.request.parameters)


@dataclass(frozen=True, eq=False)
class Curves:
    """A motion over `times` (T,) in seconds.

    `height` of the centre in m, `rotation` in degrees, RMS `deformation` in mm, RMS `error` in mm, and the
    `error_band` in mm that 90 % of motions stay below. The last two are None where they are not known.
    """

    times: Times
    height: Times
    rotation: Times
    deformation: Times
    error: Times | None
    error_band: Times | None


def same_motions(one: Frame, other: Frame) -> bool:
    """Whether two frames show the same motions, at any times."""
    return [c.motion for c in one.columns] == [c.motion for c in other.columns]


@dataclass(frozen=True, eq=False)
class Description:
    """A frame with what panels show beside it: the top of the error colour scale in mm, and the curves by column."""

    frame: Frame
    curves: tuple[Curves, ...]
    error_scale: float | None
    """None where errors are not coloured."""
    settled: bool
    """Whether the motions have not changed for a moment: time for numbers that are expensive to compute."""
