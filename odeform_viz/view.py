"""Defines requests of the user and what is displayed: plain values between session, presenter and panels."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from odeform.errors import InputError
from odeform.geometry.shape_similarity import ShapeSimilarity
from odeform.motion.base import Motion, SolveStats
from odeform.motion.limits import DEPTH
from odeform.motion.plausibility import Stop
from odeform.motion.recorded import RecordedMotion
from odeform.motion.truth_errors import DISTANCE
from odeform.schema import Window
from odeform.types import Floats, Geometry, Perpoint, Times
from odeform_viz.columns import Column

__all__ = [
    "COLOR_BY",
    "INVISIBLE",
    "REACH",
    "ColorScale",
    "Coloring",
    "ColumnFrame",
    "Curves",
    "Description",
    "DisplayOptions",
    "Error",
    "Frame",
    "Sight",
    "ViewRequest",
    "peak_of",
    "played_until",
    "same_motions",
    "shown_until",
]

INVISIBLE = 1e-4  # m; a third of a pixel for a body of 0.1 m that is 720 pixels high
REACH = 2.0  # length of the time slider in trained windows, at least
WHOLE = 1.0  # s; what goes on after a shorter window is shown, and played, up to here


def played_until(window: Window) -> float:
    """Seconds up to which a motion is played: to the end of the trained window, or on until a pushed body rests."""
    span = window.stop - window.start
    return max(window.stop, window.start + min((1.0 + window.reach) * span, WHOLE))


def shown_until(window: Window) -> float:
    """Seconds to which the time slider and the curves go."""
    return max(window.start + REACH * (window.stop - window.start), played_until(window))


@dataclass(frozen=True)
class ViewRequest:
    """Everything that decides what is computed for one frame; `time` in seconds, `parameters` in the schema's units."""

    parameters: Mapping[str, float]
    time: float
    quality: str
    """Settings of all integrations: a name such as "balanced", or `SolverSettings` as JSON."""
    columns: tuple[Column, ...]


@dataclass(frozen=True)
class Sight:
    """From where to where a camera looks, (3,) m each."""

    position: tuple[float, ...]
    look_at: tuple[float, ...]

    @classmethod
    def of(cls, position: Iterable[float], look_at: Iterable[float]) -> "Sight":
        """`InputError` for anything but three finite metres each, at two places."""
        sight = cls(tuple(map(float, position)), tuple(map(float, look_at)))
        finite = all(map(math.isfinite, (*sight.position, *sight.look_at)))
        if len(sight.position) != 3 or len(sight.look_at) != 3 or not finite or sight.position == sight.look_at:
            raise InputError(f"camera: expected two places of three metres, got {sight.position} and {sight.look_at}")
        return sight


COLOR_BY: tuple[str, ...] = ("own colours", "displacement", "strain", "error")
"""Lists what the colors of bodies can show."""


@dataclass(frozen=True)
class DisplayOptions:
    """How columns are drawn."""

    overlay: bool = False
    """Columns stand in one place instead of side by side."""
    color_by: str = "error"
    """One of `COLOR_BY`; errors need a truth, and own colors are shown without it."""
    follow: bool = True
    exaggeration: float = 1.0
    """Factor of the deformation in body axes; the rigid motion stays as it is."""
    ghost: bool = False
    """The shape at rest, moved by the same pose."""
    wireframe: bool = False
    momentary: bool = False
    """Whether the scale of colors fits each moment, instead of the whole motion."""
    viewport: tuple[int, int] = (1440, 900)
    """Width and height of the browser's canvas, in px."""


@dataclass(frozen=True)
class ColorScale:
    """Colors for values of a quantity from 0 to `top`, in `unit`."""

    quantity: str
    unit: str
    top: float
    momentary: bool = False
    """Whether it fits one moment, instead of the whole motion."""


@dataclass(frozen=True, eq=False)
class Coloring:
    """Holds what the colors of a frame show: `values` (N,) at the points of the columns of these keys."""

    scale: ColorScale
    values: Mapping[int, Perpoint]


@dataclass(frozen=True, eq=False)
class Error:
    """Distance of a prediction from the truth at one time: `distances` (N,) in metres at the truth's vertices."""

    distances: Perpoint
    rmse_mm: float
    """Over all coordinates, as is `mae_mm`: what recordings keep. The page shows distances."""
    mae_mm: float

    @property
    def rms_mm(self) -> float:
        """RMS of the distances, in millimetres: `DISTANCE` times the error over coordinates."""
        return DISTANCE * self.rmse_mm

    @property
    def mean_mm(self) -> float:
        """Mean of the distances, in millimetres."""
        return 1e3 * float(self.distances.mean())

    @property
    def worst_mm(self) -> float:
        """The largest distance, in millimetres."""
        return 1e3 * float(self.distances.max())


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
    time: float

    @property
    def stats(self) -> SolveStats:
        """Statistics of the motion's solution."""
        return self.motion.stats

    @property
    def similarity(self) -> ShapeSimilarity | None:
        """How similar the shape is to the bodies that the model was trained on; None where these are not known."""
        if not isinstance(self.motion, Motion):
            return None
        predictor = self.column.predictor
        return self.motion.similarity or (predictor.validity.similarity(self.column.geometry) if predictor else None)

    @property
    def changed(self) -> bool:
        """Whether the body has a mass or a stiffness that no data have."""
        predictor, given = self.column.predictor, self.motion.parameters
        return predictor is not None and bool(given) and predictor.model_of(given).is_changed(given)

    @property
    def untrained(self) -> bool:
        """Whether the model was not trained on this shape: figures of its errors on trained shapes do not hold."""
        return self.similarity is not None and not self.similarity.same

    def error_band(self, times: Times) -> Floats | None:
        """(T, 2) mm at (T,) seconds: the RMS distance that half, and 90 %, of motions stay below; None if not known."""
        predictor = self.column.predictor
        unknown = predictor is None or (self.untrained and not predictor.knows_untrained_errors)
        if unknown or not isinstance(self.motion, Motion):
            return None
        band = self.motion.error_band(times)
        return None if band is None else DISTANCE * band

    def stop_at(self, time: float) -> Stop | None:
        """Says what is shown in place of `time` in seconds, and why, where the motion is not physically possible."""
        return self.motion.stop_at(time) if isinstance(self.motion, Motion) else None

    @property
    def ended(self) -> bool:
        """Whether this is a recorded motion at a time after its last frame."""
        return self.column.truth is not None and self.motion.extrapolates(self.time)

    @property
    def below_floor(self) -> bool:
        """Whether the body is visibly below the floor: deeper than the simulator's contacts let it sink."""
        return self.depth > 1.001 * DEPTH  # a motion that is clamped is at this depth, up to rounding


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

    `height` of the centre in m, `rotation` from the shape at rest in degrees, which grows past whole turns, RMS
    `deformation` in mm, RMS distance from the truth in mm (`error`), and the `error_band` in mm that 90 % of motions
    stay below. The last two are None where they are not known. A truth that is over has none of them: NaN.
    """

    times: Times
    height: Times
    rotation: Times
    deformation: Times
    error: Times | None
    error_band: Times | None


def peak_of(curves: Curves, until: float, of_error: bool) -> float:
    """Seconds, up to `until`, at which the deformation or, where it is known, the error is largest."""
    values = curves.error if of_error and curves.error is not None else curves.deformation
    within = values[curves.times <= until]
    return float(curves.times[np.nanargmax(within)]) if np.isfinite(within).any() else float(curves.times[0])


def same_motions(one: Frame, other: Frame) -> bool:
    """Whether two frames show the same motions, at any times."""
    return [c.motion for c in one.columns] == [c.motion for c in other.columns]


@dataclass(frozen=True, eq=False)
class Description:
    """A frame with what panels show beside it: how it is drawn, and the curves by column."""

    frame: Frame
    curves: tuple[Curves, ...]
    options: DisplayOptions
    scale: ColorScale | None
    """None where bodies have their own colours."""
    histogram: Floats | None
    """The shares of the values along the scale; None without one."""
    settled: bool
    """Whether the motions have not changed for a moment: time for numbers that are expensive to compute."""
