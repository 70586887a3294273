"""One column of a recording: its body, its pose, its numbers."""

import json

import numpy as np
import rerun as rr

from odeform.geometry.normals import vertex_normals
from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.types import GaussianSplats, Geometry, Mesh, Perpoint, Points
from odeform_viz.colors import Color, color_of, paler
from odeform_viz.columns import Column
from odeform_viz.recording.entities import PROVENANCE, REST, STILL, WORLD
from odeform_viz.recording.provenance import provenance_of
from odeform_viz.view import ColumnFrame

__all__ = ["PLOTS", "LoggedColumn", "log_still"]

TOLERANCE = 1e-6  # m; points whose deformation changed by less are not logged again
PLOTS = {  # quantities by view; each quantity has an axis of its own
    "curves": ("height_m", "deformation_mm"),
    "errors": ("rmse_mm", "mae_mm", "worst_mm"),
    "statistics": ("evaluations", "wall_ms", "solver_error_mm"),
}


class LoggedColumn:
    """A column with one shape. What does not change is logged at once; the rest when it changes."""

    def __init__(self, stream: rr.RecordingStream, column: Column, number: int) -> None:
        """`number` counts the shapes that the column has had, from 0."""
        # named by key: labels contain spaces and characters with a meaning in paths
        self.name = f"column_{column.key}/form_{number}"
        self.column, self.number = column, number
        self.frame = -1
        """The frame in which the current points were logged."""
        self._stream = stream
        self._motion: Motion | RecordedMotion | None = None
        self._points: Points | None = None
        self._status = ""
        self._log_static()

    def forget(self) -> None:
        """Log everything again next time: the column is hidden now."""
        self._points = self._motion = None

    def _log_static(self) -> None:
        column, name, color = self.column, self.name, color_of(self.column)
        facts = rr.TextDocument(json.dumps(provenance_of(column), indent=1))
        self._stream.log(f"{PROVENANCE}/{name}", facts, static=True)
        points = np.asarray(column.geometry.points, dtype=np.float32)
        self._stream.log(f"{REST}/{name}", rr.Points3D(points), static=True)
        body = f"{WORLD}/{name}/body"
        if isinstance(column.geometry, Mesh):
            colors = _checkerboard(points, color)
            mesh = rr.Mesh3D.from_fields(triangle_indices=column.geometry.faces, vertex_colors=colors)
            self._stream.log(body, mesh, static=True)
        elif isinstance(column.geometry, GaussianSplats):
            colors, radii = _spheres(column.geometry)
            self._stream.log(body, rr.Points3D.from_fields(colors=colors, radii=radii), static=True)
        else:
            self._stream.log(body, rr.Points3D.from_fields(colors=_checkerboard(points, color)), static=True)
        for view, quantities in PLOTS.items():
            for quantity in quantities:
                lines = rr.SeriesLines(names=column.label, colors=color)
                self._stream.log(f"{view}/{quantity}/{name}", lines, static=True)

    def log(self, shown: ColumnFrame, time: float, frame: int) -> None:
        """Log one moment, `time` in s, as `frame`."""
        body, motion, pose = f"{WORLD}/{self.name}/body", shown.motion, shown.pose
        # deformations too small to see are logged as well: a replay compares more finely
        points = motion.deformed(time) if shown.points is None else shown.points
        if self._points is None or not np.abs(points - self._points).max() <= TOLERANCE:  # true also for NaN
            self._points, self.frame = points, frame
            if isinstance(self.column.geometry, Mesh):
                normals = vertex_normals(points, self.column.geometry.faces)
                self._stream.log(body, rr.Mesh3D.from_fields(vertex_positions=points, vertex_normals=normals))
            else:
                self._stream.log(body, rr.Points3D.from_fields(positions=points))
        self._stream.log(body, rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))
        for quantity, value in self._numbers(shown, time).items():
            self._stream.log(f"{quantity}/{self.name}", rr.Scalars(value))
        self._log_status(shown)
        self._motion = motion

    def _numbers(self, shown: ColumnFrame, time: float) -> dict[str, float]:
        motion, stats, pose, error = shown.motion, shown.stats, shown.pose, shown.error
        centre = np.asarray(self.column.geometry.points, dtype=float).mean(axis=0)
        numbers = {
            "curves/height_m": float(pose[2, :3] @ centre + pose[2, 3]),
            "curves/deformation_mm": 1e3 * float(motion.deformation_rms(np.array([time]))[0]),
        }
        if error is not None:
            numbers["errors/rmse_mm"] = error.rmse_mm
            numbers["errors/mae_mm"] = error.mae_mm
            numbers["errors/worst_mm"] = error.worst_mm
        if isinstance(motion, Motion):
            numbers["statistics/evaluations"] = float(stats.evaluations)
            numbers["statistics/wall_ms"] = stats.wall_ms
            # the solver's error costs as much as the motion: only for motions that are shown for more than one frame
            if motion is self._motion and (solver_error := stats.solver_error_mm) is not None:
                numbers["statistics/solver_error_mm"] = solver_error
        return numbers

    def _log_status(self, shown: ColumnFrame) -> None:
        status = f"{self.column.label}: {shown.stats.solver}, {shown.stats.status}"
        if status != self._status:
            level = rr.TextLogLevel.INFO if shown.stats.status == "ok" else rr.TextLogLevel.WARN
            self._stream.log(f"status/{self.name}", rr.TextLog(status, level=level))
            self._status = status


def log_still(stream: rr.RecordingStream, still: Geometry | None) -> None:
    """Log the part of a scene that does not move, in place of the previous one; None for nothing."""
    stream.log(STILL, rr.Clear(recursive=True))
    if isinstance(still, Mesh):
        stream.log(f"{STILL}/mesh", rr.Mesh3D(vertex_positions=still.points, triangle_indices=still.faces))
    elif still is not None:
        colors, radii = _spheres(still) if isinstance(still, GaussianSplats) else (None, None)
        stream.log(f"{STILL}/points", rr.Points3D(still.points, colors=colors, radii=radii))


def _spheres(splats: GaussianSplats) -> tuple[np.ndarray, Perpoint]:
    """Colors (N, 3), and radii (N,) in m of spheres of the same size: Rerun draws no Gaussians."""
    return splats.colors, np.sqrt(np.trace(splats.covariances, axis1=1, axis2=2) / 3.0)


def _checkerboard(points: Points, color: Color) -> np.ndarray:
    """Vertex colors (N, 3) that alternate by octant around the centre, so that rotations are visible."""
    odd = np.prod(points - 0.5 * (points.min(axis=0) + points.max(axis=0)), axis=1) > 0.0
    return np.where(odd[:, None], color, paler(color)).astype(np.uint8)
