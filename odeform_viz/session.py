"""Computes what a request asks for, and keeps motions until their inputs change. Knows no GUI types."""

import json
import math
import threading
import time
from collections.abc import Mapping, Sequence

import numpy as np

from odeform.cancellation import Cancelled
from odeform.errors import InputError
from odeform.geometry.rigid import unwrapped_vectors
from odeform.loads.registry import first_body
from odeform.models.base import Predictor
from odeform.models.registry import observations
from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.schema import Schema
from odeform.solver.integrate import SolverSettings
from odeform.types import GaussianSplats, Geometry, MotionSequence, Points, Times
from odeform_viz.columns import Column
from odeform_viz.user_bodies import user_body_of
from odeform_viz.view import INVISIBLE, ColumnFrame, Curves, Error, Frame, ViewRequest, shown_until

__all__ = ["Session", "settings_of", "visible_deformation"]

MUCH = 0.2  # of the largest deformation, above which a body counts as deformed by an impact
SLOW = 0.1  # s from a new motion to its first frame; slower columns are computed after the others

SolveInputs = tuple[Mapping[str, float], str | SolverSettings, RecordedMotion | None]
"""Lists what a motion depends on besides the shape: parameters, quality, and the record of observed frames."""


def settings_of(predictor: Predictor, quality: str) -> str | SolverSettings:
    """The quality as `predictor.solve` takes it; "balanced" where the predictor does not know the name.

    `InputError` for JSON that describes no solver settings.
    """
    if quality.startswith("{") and predictor.qualities:
        try:
            return SolverSettings(**json.loads(quality))
        except (ValueError, TypeError) as error:
            raise InputError(f"quality: expected a name or solver settings, got {quality}: {error}") from None
    return quality if quality in predictor.qualities else "balanced"


def visible_deformation(motion: Motion | RecordedMotion, time: float) -> Points | None:
    """(N, 3) metres: the deformed body without its pose; None where the deformation is too small to be visible."""
    if motion.deformation_bound(time) < INVISIBLE:
        return None
    points = motion.deformed(time)
    # the bound adds up the modes as if all were largest at one point, so the displacements decide
    moved = points - motion.geometry.points
    return None if np.einsum("ni,ni->n", moved, moved).max() < INVISIBLE**2 else points


class Session:
    """The motions of all columns. Integrates only when parameters, shape or quality change, never for a new time.

    Thread-safe: the worker asks for frames while callbacks ask for a peak or an export.
    """

    def __init__(self, schema: Schema) -> None:
        self.schema = schema
        self._lock = threading.RLock()
        # by column: its motion of the shape that is displayed, and its motion of the truth's body
        self._displayed: dict[int, tuple[SolveInputs, Motion]] = {}
        self._compared: dict[int, tuple[SolveInputs, Motion]] = {}
        self._curves: dict[int, tuple[object, object, Curves]] = {}
        self._seconds: dict[int, float] = {}  # by column: from its last new motion to the first frame of it

    def parameters(self, column: Column, request: ViewRequest) -> Mapping[str, float]:
        """Returns the parameters of a column: pinned, or those of the sliders."""
        return column.pinned if column.pinned is not None else request.parameters

    def motion(self, column: Column, request: ViewRequest) -> Motion | RecordedMotion:
        """The motion of one column; the same object until its parameters, shape or quality change."""
        source = column.source
        if not isinstance(source, Predictor):
            return source
        with self._lock:
            return self._solve(self._displayed, column, source, column.geometry, request)

    def new_motion(self, column: Column, request: ViewRequest) -> Motion:
        """A motion of a model that is not shared with the viewer: for long work outside of the lock."""
        source = column.predictor
        assert source is not None
        parameters, quality, record = self._inputs(column, source, request)
        with self._lock:
            return source.solve(column.geometry, parameters, quality, observed=_observed_frames(source, record))

    def new_compared_motion(self, column: Column, truth: RecordedMotion, request: ViewRequest) -> Motion:
        """Solves the motion of `new_motion` for the mesh of `truth` (`truth_of`), vertex by vertex."""
        source = column.predictor
        assert source is not None
        parameters, quality, record = self._inputs(column, source, request)
        geometry = source.to_body_frame(truth.geometry, parameters)
        with self._lock:
            return source.solve(geometry, parameters, quality, observed=_observed_frames(source, record))

    def truth_of(self, column: Column, request: ViewRequest) -> RecordedMotion | None:
        """The visible record, if it has the column's parameters, or these are estimated from it, and the column has the
        trained body."""
        truth = next((c.source for c in request.columns if c.visible and isinstance(c.source, RecordedMotion)), None)
        if truth is None or column.truth is not None:
            return None
        if not (column.fitted or truth.of(self.parameters(column, request))):
            return None
        body = user_body_of(column.predictor)
        if body is not None:
            return truth if np.array_equal(truth.sequence.faces, body.item.faces) else None
        return None if column.loaded else truth

    def frame(self, request: ViewRequest, include_slow: bool = True) -> Frame:
        """Compute the visible columns. `InputError` for a request that none of them can meet.

        Without `include_slow`, columns that need a new motion and took long for their last one are left pending; the
        first of them is not, if there is nothing else to show.
        """
        if not np.isfinite(request.time) or request.time < 0.0:
            raise InputError(f"time: expected seconds from 0 on, got {request.time}")
        with self._lock:
            self._forget_all_but({column.key for column in request.columns})
            visible = [column for column in request.columns if column.visible]
            slow = set() if include_slow else self._slow(visible, request)
            computed, refused, pending = [], [], []
            for column in visible:
                try:
                    if column.key not in slow:
                        computed.append(self._timed(column, request))
                    else:
                        pending.append(column.label)
                except InputError as error:
                    refused.append(str(error))
            if refused and not (computed or pending):
                raise InputError(refused[0])
            return Frame(request, tuple(computed), tuple(refused), tuple(pending))

    @property
    def curve_times(self) -> Times:
        """(T,) seconds: the frames of the trained window, continued to the end of the time slider."""
        window = self.schema.window
        return window.start + np.arange(round((shown_until(window) - window.start) * window.rate) + 1) / window.rate

    def curves(self, shown: ColumnFrame, request: ViewRequest) -> Curves:
        """Returns the curves of a column's motion; computed once for each motion."""
        truth = self.truth_of(shown.column, request)
        with self._lock:
            known = self._curves.get(shown.column.key)
            if known is None or known[0] is not shown.motion or known[1] is not truth:
                made = self._make_curves(shown, truth, request)
                known = self._curves[shown.column.key] = (shown.motion, truth, made)
            return known[2]

    def largest_deformation(self, request: ViewRequest) -> float:
        """Seconds within the trained window at which the first visible column is deformed most."""
        column = next((column for column in request.columns if column.visible), None)
        if column is None:
            return request.time
        window = self.schema.window
        times = np.linspace(window.start, window.stop, 4 * round((window.stop - window.start) * window.rate) + 1)
        with self._lock:
            return float(times[np.argmax(self.motion(column, request).deformation_rms(times))])

    def first_impact(self, request: ViewRequest) -> tuple[float, float]:
        """Finds from when to when, in s, the first visible column is deformed much for the first time; equal if
        never."""
        column = next((column for column in request.columns if column.visible), None)
        if column is None:
            return (request.time, request.time)
        window = self.schema.window
        times = np.linspace(window.start, window.stop, 4 * round((window.stop - window.start) * window.rate) + 1)
        with self._lock:
            deformation = self.motion(column, request).deformation_rms(times)
        much = deformation > MUCH * deformation.max()
        first = int(much.argmax())
        after = ~much[first:]
        last = first + int(after.argmax()) if after.any() else len(times) - 1
        return (float(times[max(first - 1, 0)]), float(times[last])) if much.any() else (window.start, window.start)

    def _forget_all_but(self, keys: set[int]) -> None:
        for cache in (self._displayed, self._compared, self._curves, self._seconds):
            for key in cache.keys() - keys:
                del cache[key]

    def _inputs(self, column: Column, source: Predictor, request: ViewRequest) -> SolveInputs:
        parameters = source.schema.known(self.parameters(column, request))
        return parameters, settings_of(source, request.quality), self._observed(column, source, request)

    def _observed(self, column: Column, source: Predictor, request: ViewRequest) -> RecordedMotion | None:
        """The record that a model interpolates; None for models that need none."""
        if not source.schema.needs_observations:
            return None
        record = next((c.source for c in request.columns if isinstance(c.source, RecordedMotion)), None)
        if record is None or not record.of(self.parameters(column, request)):
            raise InputError(f"{column.label} interpolates observed frames: expected a truth of these parameters")
        return record

    def _solve(
        self,
        cache: dict[int, tuple[SolveInputs, Motion]],
        column: Column,
        source: Predictor,
        geometry: Geometry,
        request: ViewRequest,
    ) -> Motion:
        inputs = self._inputs(column, source, request)
        known = cache.get(column.key)
        if known is None or known[0] != inputs or known[1].geometry is not geometry:
            parameters, quality, record = inputs
            motion = source.solve(geometry, parameters, quality, observed=_observed_frames(source, record))
            known = cache[column.key] = (inputs, motion)
        return known[1]

    def _predicted_truth(
        self, column: Column, source: Predictor, truth: RecordedMotion, request: ViewRequest
    ) -> Motion:
        """The model's motion of the record's body, vertex by vertex."""
        parameters = source.schema.known(self.parameters(column, request))
        geometry = source.to_body_frame(truth.geometry, parameters)
        return self._solve(self._compared, column, source, geometry, request)

    def _slow(self, columns: Sequence[Column], request: ViewRequest) -> set[int]:
        """Keys of the slow ones; where all are slow, without the first: the viewport is never empty."""
        slow = [column.key for column in columns if self._is_slow(column, request)]
        return set(slow[1:] if len(slow) == len(columns) else slow)

    def _is_slow(self, column: Column, request: ViewRequest) -> bool:
        """Whether a column needs a new motion, and took long for its last one."""
        if column.predictor is None or self._seconds.get(column.key, 0.0) < SLOW:
            return False
        known = self._displayed.get(column.key)
        try:
            inputs = self._inputs(column, column.predictor, request)
        except InputError:
            return False  # it is refused at once
        return known is None or known[0] != inputs or known[1].geometry is not column.geometry

    def _timed(self, column: Column, request: ViewRequest) -> ColumnFrame:
        before, begin = self._displayed.get(column.key), time.perf_counter()
        try:
            frame = self._column(column, request)
        except Cancelled:
            self._displayed.pop(column.key, None)
            self._seconds[column.key] = math.inf
            raise
        if self._displayed.get(column.key) is not before:
            self._seconds[column.key] = time.perf_counter() - begin
        return frame

    def _column(self, column: Column, request: ViewRequest) -> ColumnFrame:
        motion, time = self.motion(column, request), request.time
        pose = motion.placement(time)
        points = visible_deformation(motion, time)
        body = motion.geometry.points if points is None else points
        heights = body @ pose[2, :3].astype(np.float32) + np.float32(pose[2, 3])
        lowest = float(heights.min())
        if not (np.isfinite(heights).all() and np.isfinite(pose).all()):
            raise InputError(f"{column.label} at t = {time:.3f} s is not finite; the last good frame stays")
        covariances = None
        if points is not None and isinstance(motion, Motion) and isinstance(column.geometry, GaussianSplats):
            covariances = motion.deformed_covariances(time)
        depth, error = max(-lowest, 0.0), self._error(column, request)
        return ColumnFrame(column, motion, points, covariances, pose, depth, error, time)

    def _error(self, column: Column, request: ViewRequest) -> Error | None:
        truth = self.truth_of(column, request)
        if truth is None or truth.extrapolates(request.time) or column.predictor is None:
            return None
        predicted = self._predicted_truth(column, column.predictor, truth, request).vertices(request.time)
        true = truth.vertices(request.time)
        difference = np.subtract(predicted, true, dtype=float)
        distances = np.linalg.norm(difference, axis=1)
        rmse, mae = 1e3 * np.sqrt((difference**2).mean()), 1e3 * np.abs(difference).mean()
        return Error(distances, float(rmse), float(mae))

    def _make_curves(self, shown: ColumnFrame, truth: RecordedMotion | None, request: ViewRequest) -> Curves:
        motion, times, predictor = shown.motion, self.curve_times, shown.column.predictor
        poses = motion.pose(times)
        points = np.asarray(motion.geometry.points, dtype=float)
        centre = points[first_body(motion.schema.scene, len(points))].mean(axis=0)
        height = poses[:, 2, :3] @ centre + poses[:, 2, 3]
        turned = poses[:, :3, :3] @ poses[0, :3, :3].T  # since it began: a dropped body may begin turned
        rotation = np.degrees(np.linalg.norm(unwrapped_vectors(turned), axis=1))
        error = band = None
        if (both := shown.error_band(times)) is not None:
            band = both[:, 1]
        if truth is not None and predictor is not None:
            predicted = self._predicted_truth(shown.column, predictor, truth, request)
            difference = predicted.vertices(times) - truth.vertices(times)
            error = 1e3 * np.sqrt((difference.astype(float) ** 2).sum(axis=2).mean(axis=1))
            error[[truth.extrapolates(float(t)) for t in times]] = np.nan
        deformation = 1e3 * motion.deformation_rms(times)
        if isinstance(motion, RecordedMotion):
            over = [motion.extrapolates(float(t)) for t in times]
            for values in (height, rotation, deformation):
                values[over] = np.nan
        return Curves(times, height, rotation, deformation, error, band)


def _observed_frames(source: Predictor, record: RecordedMotion | None) -> MotionSequence | None:
    return None if record is None else observations(source.schema, record.sequence)
