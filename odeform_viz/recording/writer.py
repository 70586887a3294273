"""Frames -> Rerun. One recording a session, from which every frame can be computed again."""

import json
import os
import shutil
import time
import uuid
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from odeform.errors import InputError
from odeform.geometry.normals import vertex_normals
from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.types import GaussianSplats, Geometry, Mesh, Perpoint, Points
from odeform_viz.colors import Color, color_of, paler
from odeform_viz.columns import Column
from odeform_viz.recording.provenance import provenance_of, versions
from odeform_viz.recording.reader import END, FORMAT, HEADER, MOTION, PROVENANCE, REQUEST, REST, SHOWN, WORLD
from odeform_viz.view import ColumnFrame, Frame

__all__ = ["Recorder"]

STILL = f"{WORLD}/still"
TINY = 1e-6  # m; points that moved less than this before the pose are not sent again
FLUSH = 1.0  # s of what was shown that a killed process loses at most
PATIENCE = 10.0  # s that a disk may take
PLOTS = {  # views of curves, and the quantities in each: a scale of its own for each quantity
    "curves": ("height_m", "deformation_mm"),
    "errors": ("rmse_mm", "mae_mm", "worst_mm"),
    "statistics": ("evaluations", "wall_ms", "solver_error_mm"),
}


@dataclass(eq=False)
class _Form:
    """A column of one shape: its name in the recording, and what was last sent of it."""

    name: str
    column: Column
    number: int
    motion: Motion | RecordedMotion | None = None
    points: Points | None = None
    frame: int = -1
    """The frame that the points were sent in."""
    status: str = ""


class Recorder:
    """Logs every published frame to a file. Use from one thread: Rerun's clock is thread-local."""

    def __init__(self, path: str | Path) -> None:
        """`InputError` for a place where nothing can be written."""
        self.path = Path(path)
        self.frames = 0
        self._forms: dict[int, _Form] = {}
        self._present: dict[str, _Form] = {}
        self._still: Geometry | None = None
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("ab"):
                pass
        except OSError as error:
            raise InputError(f"recording {path}: cannot be written: {error.strerror}") from None
        # fewer, longer chunks than by default: each costs a kilobyte of file and, until its end, some of memory
        batches = rr.ChunkBatcherConfig(flush_tick=FLUSH)
        self._stream = rr.RecordingStream("odeform", recording_id=uuid.uuid4(), batcher_config=batches)
        self._sound, self._flushed = 0, 0.0
        try:
            self._stream.save(str(path))
        except RuntimeError as error:
            raise InputError(f"recording {path}: cannot be written: {error}") from None
        self._stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self._log_json(HEADER, {"odeform_recording": FORMAT, "versions": versions()}, static=True)
        self._flush()

    def log(self, frame: Frame) -> None:
        """`InputError` where no more can be written; the recording is then over, and whole up to its last second."""
        self._stream.set_time(SHOWN, sequence=self.frames)
        self._stream.set_time(MOTION, duration=frame.request.time)
        known = list(self._forms.values())
        shown = [(self._form(column), column) for column in frame.columns]
        if list(self._forms.values()) != known:
            self._stream.send_blueprint(_blueprint(self._forms.values()), make_default=True)
        present = {form.name: form for form, _ in shown}
        for name in self._present.keys() - present.keys():
            self._stream.log(f"{WORLD}/{name}", rr.Clear(recursive=True))
            self._present[name].points = self._present[name].motion = None
        self._present = present
        self._log_still(frame)
        for name, value in frame.request.parameters.items():
            self._stream.log(["parameters", name], rr.Scalars(value))
        for form, column in shown:
            self._log_column(form, column, frame.request.time)
        request = {
            "time": float(frame.request.time),
            "quality": frame.request.quality,
            "parameters": {name: float(value) for name, value in frame.request.parameters.items()},
            "columns": {name: form.frame for name, form in present.items()},
        }
        self._log_json(REQUEST, request)
        self.frames += 1
        if time.monotonic() - self._flushed > FLUSH:
            self._flush()

    def close(self) -> None:
        """`InputError` where the end could not be written any more."""
        self._log_json(END, {"frames": self.frames}, static=True)
        self._flush()
        self._stream.disconnect()

    def _flush(self) -> None:
        try:
            self._stream.flush(timeout_sec=PATIENCE)
            self._sound, self._flushed = self.path.stat().st_size, time.monotonic()
        except (RuntimeError, ValueError, OSError):
            self._stream.disconnect()
            raise InputError(f"recording {self.path}: {self._give_up()}") from None

    def _give_up(self) -> str:
        """Cut off what was written in part, so that the rest can be read; what to tell."""
        try:
            os.truncate(self.path, self._sound)
            free = shutil.disk_usage(self.path.parent).free >> 20
        except OSError as error:
            return f"can no longer be written: {error.strerror}"
        return f"can no longer be written, with {free:,} MiB free on its disk; it ends before frame {self.frames}"

    def _log_json(self, path: str, value: Any, static: bool = False) -> None:
        """Floats are written so that they read back to the last bit."""
        self._stream.log(path, rr.TextDocument(json.dumps(value, indent=1)), static=static)

    def _form(self, shown: ColumnFrame) -> _Form:
        """The column with its present shape; what stays is logged when it first appears. Earlier shapes are let go."""
        column = shown.column
        form = self._forms.get(column.key)
        if form is None or form.column.geometry is not column.geometry:
            # named by key: labels have spaces and signs that mean something in paths
            number = 0 if form is None else form.number + 1
            form = self._forms[column.key] = _Form(f"column_{column.key}/form_{number}", column, number)
            self._log_static(form, color_of(column))
        return form

    def _log_static(self, form: _Form, color: Color) -> None:
        column, name = form.column, form.name
        self._log_json(f"{PROVENANCE}/{name}", provenance_of(column), static=True)
        points = np.asarray(column.geometry.points, dtype=np.float32)
        self._stream.log(f"{REST}/{name}", rr.Points3D(points), static=True)
        body = f"{WORLD}/{name}/body"
        if isinstance(column.geometry, Mesh):
            mesh = rr.Mesh3D.from_fields(triangle_indices=column.geometry.faces, vertex_colors=_octants(points, color))
            self._stream.log(body, mesh, static=True)
        elif isinstance(column.geometry, GaussianSplats):
            colors, radii = _look(column.geometry)
            self._stream.log(body, rr.Points3D.from_fields(colors=colors, radii=radii), static=True)
        else:
            self._stream.log(body, rr.Points3D.from_fields(colors=_octants(points, color)), static=True)
        for view, quantities in PLOTS.items():
            for quantity in quantities:
                lines = rr.SeriesLines(names=column.label, colors=color)
                self._stream.log(f"{view}/{quantity}/{name}", lines, static=True)

    def _log_still(self, frame: Frame) -> None:
        """What stands still about the columns, when it appears, and that it is gone."""
        still = frame.still
        if still is self._still:
            return
        self._still = still
        self._stream.log(STILL, rr.Clear(recursive=True))
        if isinstance(still, Mesh):
            self._stream.log(f"{STILL}/mesh", rr.Mesh3D(vertex_positions=still.points, triangle_indices=still.faces))
        elif still is not None:
            colors, radii = _look(still) if isinstance(still, GaussianSplats) else (None, None)
            self._stream.log(f"{STILL}/points", rr.Points3D(still.points, colors=colors, radii=radii))

    def _log_column(self, form: _Form, shown: ColumnFrame, time: float) -> None:
        body, motion, pose = f"{WORLD}/{form.name}/body", shown.motion, shown.pose
        # what is too small to be seen is recorded all the same: a replay measures finer
        points = motion.deformed(time) if shown.points is None else shown.points
        if form.points is None or not np.abs(points - form.points).max() <= TINY:  # also what is not a number
            form.points, form.frame = points, self.frames
            if isinstance(form.column.geometry, Mesh):
                normals = vertex_normals(points, form.column.geometry.faces)
                self._stream.log(body, rr.Mesh3D.from_fields(vertex_positions=points, vertex_normals=normals))
            else:
                self._stream.log(body, rr.Points3D.from_fields(positions=points))
        self._stream.log(body, rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))
        self._log_numbers(form, shown, time)

    def _log_numbers(self, form: _Form, shown: ColumnFrame, time: float) -> None:
        motion, stats, pose = shown.motion, shown.stats, shown.pose
        centre = np.asarray(form.column.geometry.points, dtype=float).mean(axis=0)
        numbers: dict[str, float | None] = {
            "curves/height_m": float(pose[2, :3] @ centre + pose[2, 3]),
            "curves/deformation_mm": 1e3 * float(motion.deformation_rms(np.array([time]))[0]),
        }
        if shown.error is not None:
            error = shown.error
            numbers |= {
                "errors/rmse_mm": error.rmse_mm,
                "errors/mae_mm": error.mae_mm,
                "errors/worst_mm": error.worst_mm,
            }
        if isinstance(motion, Motion):
            numbers |= {"statistics/evaluations": float(stats.evaluations), "statistics/wall_ms": stats.wall_ms}
            # it costs as much as the motion: for those that are looked at for longer than a frame
            numbers["statistics/solver_error_mm"] = stats.solver_error_mm if motion is form.motion else None
        for quantity, value in numbers.items():
            if value is not None:
                self._stream.log(f"{quantity}/{form.name}", rr.Scalars(value))
        status = f"{form.column.label}: {stats.solver}, {stats.status}"
        if status != form.status:
            level = rr.TextLogLevel.INFO if stats.status == "ok" else rr.TextLogLevel.WARN
            self._stream.log(f"status/{form.name}", rr.TextLog(status, level=level))
        form.motion, form.status = motion, status


def _look(splats: GaussianSplats) -> tuple[np.ndarray, Perpoint]:
    """Colours, and radii in metres of spheres as large: Rerun draws no Gaussians."""
    return splats.colors, np.sqrt(np.trace(splats.covariances, axis1=1, axis2=2) / 3.0)


def _octants(points: Points, color: Color) -> np.ndarray:
    """(N, 3) the colour and a paler one in turn about the centre: a body of one colour hides how it turns."""
    odd = np.prod(points - 0.5 * (points.min(axis=0) + points.max(axis=0)), axis=1) > 0.0
    return np.where(odd[:, None], color, paler(color)).astype(np.uint8)


def _blueprint(forms: Iterable[_Form]) -> rrb.Blueprint:
    """A view in space for each column, curves below."""
    forms = list(forms)
    spaces = [
        rrb.Spatial3DView(
            origin=WORLD, contents=[f"{WORLD}/column_{f.column.key}/**", f"{STILL}/**"], name=f.column.label
        )
        for f in forms
    ]
    plots = {
        view: [rrb.TimeSeriesView(origin=f"{view}/{quantity}", name=quantity) for quantity in quantities]
        for view, quantities in PLOTS.items()
    }
    said = [rrb.TextDocumentView(origin=f"{PROVENANCE}/{f.name}", name=f"of {f.column.label}") for f in forms]
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(*spaces),
            rrb.Horizontal(
                rrb.TimeSeriesView(origin="parameters", name="parameters"),
                *plots["curves"],
                rrb.Tabs(*plots["errors"]),
                rrb.Tabs(
                    *plots["statistics"],
                    rrb.TextLogView(origin="status", name="status"),
                    rrb.TextDocumentView(origin=REQUEST, name="request"),
                    *said,
                ),
            ),
            row_shares=[3, 2],
        ),
        rrb.TimePanel(timeline=SHOWN, state="collapsed"),
        collapse_panels=True,
    )
