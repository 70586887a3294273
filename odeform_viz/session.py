"""What the user requests, and what is then to be seen. Knows predictors and motions, no GUI types."""

import json
import math
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from odeform.cancellation import Cancelled
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.registry import observations
from odeform.motion.base import Motion, SolveStats
from odeform.motion.recorded import RecordedMotion
from odeform.schema import REACH as CONTINUED
from odeform.schema import Schema
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, GaussianSplats, Geometry, MotionSequence, Perpoint, Points, Times, Vector
from odeform_viz.columns import Column

__all__ = [
    "INVISIBLE",
    "REACH",
    "ColumnFrame",
    "Curves",
    "DisplayOptions",
    "Error",
    "Frame",
    "Session",
    "ViewRequest",
    "same_motions",
    "visible_deformation",
]

INVISIBLE = 1e-4  # m; a third of a pixel of a ball of 0.1 m that is 720 pixels high
SUNK = 5e-3  # m below the floor; the simulator itself lets a ball in by up to 3 mm
REACH = 1.0 + CONTINUED  # trained windows that one can look at: as far as models go on
SLOW = 0.1  # s to a motion's first moment; who takes longer does not hold up the others


@dataclass(frozen=True)
class ViewRequest:
    """Everything that decides what is shown."""

    parameters: Mapping[str, float]
    time: float
    quality: str
    """Of all integrations: a name, or a setting as JSON."""
    columns: tuple[Column, ...]


@dataclass(frozen=True)
class DisplayOptions:
    """How columns are shown: one over the other or in a row, errors in colours, the camera at the body's side."""

    overlay: bool = False
    heat: bool = True
    follow: bool = True


@dataclass(frozen=True, eq=False)
class Error:
    """How far a prediction is from the truth at one moment: `distances` (N,) metres at the truth's vertices."""

    distances: Perpoint
    rmse_mm: float
    """Over all coordinates, as is `mae_mm`."""
    mae_mm: float
    worst: int
    """The vertex that is farthest off."""
    where: Vector
    """(3,) metres: where the truth has it."""

    @property
    def worst_mm(self) -> float:
        return 1e3 * float(self.distances[self.worst])


@dataclass(frozen=True, eq=False)
class ColumnFrame:
    """One column at one moment: the `pose` (4, 4), and what it moves.

    `points` (N, 3) is the body deformed where it rests, `covariances` (N, 3, 3) in m^2 those of its splats, if it is
    made of any; None where the deformation is too small to be seen, and the pose says it all. `depth` is how far the
    body is below the floor, in metres. `error` is that against the truth, where there is one of these parameters.
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
        return self.motion.stats

    @property
    def sunk(self) -> bool:
        return self.depth > SUNK


@dataclass(frozen=True, eq=False)
class Frame:
    """All visible columns at one moment, in the order of the request.

    Columns that cannot meet it are `refused`, with a reason; `pending` are the labels of those still to be computed.
    """

    request: ViewRequest
    columns: tuple[ColumnFrame, ...]
    refused: tuple[str, ...] = ()
    pending: tuple[str, ...] = ()

    def follows(self, request: ViewRequest) -> bool:
        """Whether this is of a request that differs in time alone."""
        return replace(request, time=self.request.time) == self.request

    @cached_property
    def truth(self) -> ColumnFrame | None:
        return next((shown for shown in self.columns if shown.column.truth), None)

    @cached_property
    def still(self) -> Geometry | None:
        """What stands still about the columns."""
        fits = (shown.column.fit for shown in self.columns if shown.column.fit)
        return next((fit.still for fit in fits if fit.still), None)


@dataclass(frozen=True, eq=False)
class Curves:
    """A motion over time: `times` (T,) s, `height` of the centre in m, `turn` in degrees, RMS `deformation`, pooled
    `error` and the `expected` one that nine in ten motions keep to in mm, the last two None where nothing is known."""

    times: Times
    height: Times
    turn: Times
    deformation: Times
    error: Times | None
    expected: Times | None


Asked = tuple[Mapping[str, float], str | SolverSettings, RecordedMotion | None]
"""Of a model: parameters, quality, and the record that it is given frames of."""


def same_motions(one: Frame, other: Frame) -> bool:
    """Whether two frames differ in time alone."""
    return [shown.motion for shown in one.columns] == [shown.motion for shown in other.columns]


def quality_of(source: Predictor, requested: str) -> str | SolverSettings:
    """The settings that a model takes; those that do not know the name, or do not integrate, take their default."""
    if requested.startswith("{") and source.qualities:
        try:
            return SolverSettings(**json.loads(requested))
        except (ValueError, TypeError) as error:
            raise InputError(f"quality: expected a name or the setting of a solver, got {requested}: {error}") from None
    return requested if requested in source.qualities else "balanced"


def _given(source: Predictor, record: RecordedMotion | None) -> MotionSequence | None:
    return None if record is None else observations(source.schema, record.sequence)


class Session:
    """Columns under one set of parameters and one time. Integrates only when parameters or quality change.

    The worker asks for frames while callbacks ask for a peak or an export: one at a time.
    """

    def __init__(self, schema: Schema) -> None:
        self.schema = schema
        self._lock = threading.RLock()
        self._solved: dict[tuple[int, int], tuple[Asked, Motion]] = {}
        self._curves: dict[int, tuple[object, object, Curves]] = {}
        self._took: dict[int, float] = {}  # s, by column: to a moment of its last new motion

    def parameters(self, column: Column, request: ViewRequest) -> Mapping[str, float]:
        """Those that a column stands for."""
        return column.pinned if column.pinned is not None else request.parameters

    def motion(self, column: Column, request: ViewRequest) -> Motion | RecordedMotion:
        """The motion of one column; the same object until its parameters, shape or quality change."""
        source = column.source
        if isinstance(source, RecordedMotion):
            return source
        with self._lock:
            return self._solve(column, source, 0, column.geometry, request)

    def own_motion(self, column: Column, request: ViewRequest) -> Motion:
        """The motion of a model, for long work beside the page: nobody else asks it or waits for it."""
        source = column.predictor
        assert source is not None
        parameters, quality, record = self._asked(column, source, request)
        with self._lock:
            return source.solve(column.geometry, parameters, quality, observed=_given(source, record))

    def _asked(self, column: Column, source: Predictor, request: ViewRequest) -> Asked:
        """Parameters and quality that a model knows, and the record that it is given frames of."""
        parameters = source.schema.known(self.parameters(column, request))
        return parameters, quality_of(source, request.quality), self._observed(column, source, request)

    def _solve(self, column: Column, source: Predictor, use: int, geometry: Geometry, request: ViewRequest) -> Motion:
        asked = self._asked(column, source, request)
        known = self._solved.get((column.key, use))
        if known is None or known[0] != asked or known[1].geometry is not geometry:
            parameters, quality, record = asked
            motion = source.solve(geometry, parameters, quality, observed=_given(source, record))
            known = self._solved[column.key, use] = (asked, motion)
        return known[1]

    def _waits(self, column: Column, request: ViewRequest) -> bool:
        """Whether a column is to be computed after the others."""
        if column.predictor is None or self._took.get(column.key, 0.0) < SLOW:
            return False
        known = self._solved.get((column.key, 0))
        asked = self._asked(column, column.predictor, request)
        return known is None or known[0] != asked or known[1].geometry is not column.geometry

    def _observed(self, column: Column, source: Predictor, request: ViewRequest) -> RecordedMotion | None:
        """The record that a model moves between frames of; None for models that need none."""
        if not source.schema.needs_observations:
            return None
        record = next((c.source for c in request.columns if isinstance(c.source, RecordedMotion)), None)
        if record is None or not record.of(self.parameters(column, request)):
            raise InputError(f"{column.label} moves between observed frames: expected the truth of these parameters")
        return record

    def _of_truth(self, column: Column, source: Predictor, truth: RecordedMotion, request: ViewRequest) -> Motion:
        """What a model makes of the body of the record."""
        known = source.schema.known(self.parameters(column, request))
        return self._solve(column, source, 1, source.to_body_frame(truth.geometry, known), request)

    def truth_of(self, column: Column, request: ViewRequest) -> RecordedMotion | None:
        """The record among the columns, where it is of this column's parameters and body."""
        truth = next((c.source for c in request.columns if c.shown and isinstance(c.source, RecordedMotion)), None)
        if truth is None or column.truth is not None or not truth.of(self.parameters(column, request)):
            return None
        return None if column.foreign else truth

    def frame(self, request: ViewRequest, whole: bool = True) -> Frame:
        """What is to be seen; only visible columns are computed. `InputError` for requests that none of them can meet.

        Unless it is to be `whole`, columns that took long when they last had a new motion to compute are left pending.
        """
        if not np.isfinite(request.time) or request.time < 0.0:
            raise InputError(f"time: expected seconds from 0 on, got {request.time}")
        kept = {column.key for column in request.columns}
        with self._lock:
            self._solved = {at: motion for at, motion in self._solved.items() if at[0] in kept}
            self._curves = {key: curves for key, curves in self._curves.items() if key in kept}
            self._took = {key: took for key, took in self._took.items() if key in kept}
            shown, refused, pending = [], [], []
            for column in (column for column in request.columns if column.shown):
                try:
                    if whole or not self._waits(column, request):
                        shown.append(self._timed(column, request))
                    else:
                        pending.append(column.label)
                except InputError as error:
                    refused.append(str(error))
            if refused and not (shown or pending):
                raise InputError(refused[0])
            return Frame(request, tuple(shown), tuple(refused), tuple(pending))

    def _timed(self, column: Column, request: ViewRequest) -> ColumnFrame:
        before, begin = self._solved.get((column.key, 0)), time.perf_counter()
        try:
            frame = self._column(column, request)
        except Cancelled:
            self._solved.pop((column.key, 0), None)
            self._took[column.key] = math.inf
            raise
        if self._solved.get((column.key, 0)) is not before:
            self._took[column.key] = time.perf_counter() - begin
        return frame

    def _column(self, column: Column, request: ViewRequest) -> ColumnFrame:
        motion, time = self.motion(column, request), request.time
        pose = motion.pose(time)
        points = visible_deformation(motion, time)
        body = motion.geometry.points if points is None else points
        heights = body @ pose[2, :3].astype(np.float32) + np.float32(pose[2, 3])
        lowest = float(heights.min())
        if not (np.isfinite(heights).all() and np.isfinite(pose).all()):
            raise InputError(f"{column.label} at t = {time:.3f} s is not finite; the last good frame stays")
        covariances = None
        if points is not None and isinstance(motion, Motion) and isinstance(column.geometry, GaussianSplats):
            covariances = motion.deformed_covariances(time)
        return ColumnFrame(column, motion, points, covariances, pose, max(-lowest, 0.0), self._error(column, request))

    def _error(self, column: Column, request: ViewRequest) -> Error | None:
        truth = self.truth_of(column, request)
        if truth is None or truth.extrapolates(request.time) or column.predictor is None:
            return None
        predicted = self._of_truth(column, column.predictor, truth, request).vertices(request.time)
        true = truth.vertices(request.time)
        off = np.subtract(predicted, true, dtype=float)
        distances = np.linalg.norm(off, axis=1)
        worst = int(distances.argmax())
        rmse, mae = 1e3 * np.sqrt((off**2).mean()), 1e3 * np.abs(off).mean()
        return Error(distances, float(rmse), float(mae), worst, true[worst].astype(float))

    @property
    def times(self) -> Times:
        """The moments of curves: the frames of the window, and on to where one can look."""
        window = self.schema.window
        return window.start + np.arange(round(REACH * (window.stop - window.start) * window.rate) + 1) / window.rate

    def curves(self, shown: ColumnFrame, request: ViewRequest) -> Curves:
        """Of the whole motion that a column shows; made once for each."""
        truth = self.truth_of(shown.column, request)
        with self._lock:
            known = self._curves.get(shown.column.key)
            if known is None or known[0] is not shown.motion or known[1] is not truth:
                made = self._make_curves(shown, truth, request)
                known = self._curves[shown.column.key] = (shown.motion, truth, made)
            return known[2]

    def _make_curves(self, shown: ColumnFrame, truth: RecordedMotion | None, request: ViewRequest) -> Curves:
        motion, times = shown.motion, self.times
        poses = motion.pose(times)
        centre = np.asarray(motion.geometry.points, dtype=float).mean(axis=0)
        height = poses[:, 2, :3] @ centre + poses[:, 2, 3]
        turn = np.degrees(np.arccos(np.clip((np.trace(poses[:, :3, :3], axis1=1, axis2=2) - 1.0) / 2.0, -1.0, 1.0)))
        error = expected = None
        if shown.column.predictor is not None:
            band = shown.column.predictor.error_band(motion.parameters, times)
            expected = None if band is None else band[:, 1]
        if truth is not None and shown.column.predictor is not None:
            predicted = self._of_truth(shown.column, shown.column.predictor, truth, request)
            off = predicted.vertices(times) - truth.vertices(times)
            error = 1e3 * np.sqrt((off.astype(float) ** 2).mean(axis=(1, 2)))
            error[[truth.extrapolates(float(t)) for t in times]] = np.nan
        return Curves(times, height, turn, 1e3 * motion.deformation_rms(times), error, expected)

    def largest_deformation(self, request: ViewRequest) -> float:
        """The time within the trained window at which the first visible column is deformed most."""
        column = next((column for column in request.columns if column.shown), None)
        if column is None:
            return request.time
        window = self.schema.window
        times = np.linspace(window.start, window.stop, 4 * round((window.stop - window.start) * window.rate) + 1)
        with self._lock:
            return float(times[np.argmax(self.motion(column, request).deformation_rms(times))])


def visible_deformation(motion: Motion | RecordedMotion, time: float) -> Points | None:
    """(N, 3) metres, the deformation alone; None where it cannot be seen, and a pose says all."""
    if motion.deformation_bound(time) < INVISIBLE:
        return None
    points = motion.deformed(time)
    # the bound takes every mode to be at its largest at the same point
    moved = points - motion.geometry.points
    return None if np.einsum("ni,ni->n", moved, moved).max() < INVISIBLE**2 else points
