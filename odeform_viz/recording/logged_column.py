"""One column of a recording: its body, its pose, its arrows, its numbers."""

import json

import numpy as np
import rerun as rr

from odeform.geometry.normals import vertex_normals
from odeform.loads.arrow import Arrow
from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.simulation.scenes.registry import find_scene
from odeform.types import Floats, GaussianSplats, Mesh, Points
from odeform_viz.colors import Color, color_of, paler
from odeform_viz.columns import Column
from odeform_viz.obstacles import obstacles_of
from odeform_viz.recording.entities import COEFFICIENTS, MODES, POINTS, PROVENANCE, REST, WORLD
from odeform_viz.recording.modes import ModeEncoder
from odeform_viz.recording.provenance import provenance_of
from odeform_viz.recording.shown_points import ShownBudget
from odeform_viz.recording.splats import ELLIPSOID_BYTES, ellipsoids, paint
from odeform_viz.recording.surroundings import log_arrows, log_obstacles
from odeform_viz.view import ColumnFrame

__all__ = ["PLOTS", "LoggedColumn"]

TOLERANCE = 1e-6  # m; points whose deformation changed by less are not logged again
PLOTS = {  # quantities by the unit of their common plot
    "m": ("curves/height_m",),
    "mm": (
        "curves/deformation_mm",
        "errors/rmse_mm",
        "errors/mae_mm",
        "errors/worst_mm",
        "statistics/solver_error_mm",
    ),
    "ms": ("statistics/wall_ms",),
    "evaluations": ("statistics/evaluations",),
}


class LoggedColumn:
    """A column with one shape. What does not change is logged at once; the rest when it changes."""

    def __init__(self, stream: rr.RecordingStream, column: Column, number: int, budget: ShownBudget) -> None:
        """`number` counts the shapes that the column has had, from 0; `budget` limits the points that are shown."""
        # named by key: labels contain spaces and characters with a meaning in paths
        self.name = f"column_{column.key}/form_{number}"
        self.column, self.number = column, number
        self.frame = -1
        """The frame in which the current points were logged."""
        self._stream, self._budget = stream, budget
        self._rest = np.asarray(column.geometry.points, dtype=np.float32)
        self._encoder = ModeEncoder(self._rest)
        self._motion: Motion | RecordedMotion | None = None
        self._points: Points | None = None
        self._shown: Points | None = None
        self._arrows: tuple[Arrow, ...] = ()
        self._acting: tuple[bool, ...] = ()
        self._obstacles = False  # whether there are any
        self._status = ""
        self._log_static()

    def forget(self) -> None:
        """Log everything again next time: the column is hidden now."""
        self._points = self._shown = self._motion = None
        self._acting = ()

    def _log_static(self) -> None:
        column, name, color = self.column, self.name, color_of(self.column)
        facts = rr.TextDocument(json.dumps(provenance_of(column), indent=1))
        self._stream.log(f"{PROVENANCE}/{name}", facts, static=True)
        points = self._rest
        self._stream.log(f"{REST}/{name}", rr.Points3D(points), static=True)
        body = f"{WORLD}/{name}/body"
        if isinstance(column.geometry, Mesh):
            colors = _checkerboard(points, color) if column.geometry.colors is None else _vertex_colors(column.geometry)
            mesh = rr.Mesh3D.from_fields(triangle_indices=column.geometry.faces, vertex_colors=colors)
            self._stream.log(body, mesh, static=True)
        elif isinstance(column.geometry, GaussianSplats):
            self._stream.log(body, paint(column.geometry), static=True)
        else:
            self._stream.log(body, rr.Points3D.from_fields(colors=_checkerboard(points, color)), static=True)
        for unit, quantities in PLOTS.items():
            for quantity in quantities:
                title = quantity.rpartition("/")[2].removesuffix(f"_{unit}").replace("_", " ")
                lines = rr.SeriesLines(names=f"{column.label}: {title}", colors=color)
                self._stream.log(f"{quantity}/{name}", lines, static=True)

    def log(self, shown: ColumnFrame, time: float, frame: int) -> None:
        """Log one moment, `time` in s, as `frame`."""
        motion, pose = shown.motion, shown.pose
        # deformations too small to see are logged as well: a replay compares more finely
        points = motion.deformed(time) if shown.points is None else shown.points
        if self._points is None or not np.abs(points - self._points).max() <= TOLERANCE:  # true also for NaN
            self._points, self.frame = points, frame
            self._log_points(points)
        self._show_points(points, shown.covariances)
        transform = rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3])
        self._stream.log(f"{WORLD}/{self.name}/body", transform)
        for quantity, value in self._numbers(shown, time).items():
            self._stream.log(f"{quantity}/{self.name}", rr.Scalars(value))
        self._log_status(shown, time)
        self._show_arrows(motion, time)
        self._motion = motion

    def _log_points(self, points: Points) -> None:
        """Log what a replay compares."""
        encoded = self._encoder.encode(points)
        if encoded is None:
            self._stream.log(f"{POINTS}/{self.name}", rr.Points3D(points))
            return
        coefficients, mode = encoded
        if mode is not None:
            self._stream.log(f"{MODES}/{self.name}", rr.Points3D(mode))
        # a value is always there: a row without any would not be told from none
        self._stream.log(f"{COEFFICIENTS}/{self.name}", rr.Scalars(np.append(coefficients, 0.0)))

    def _show_points(self, points: Points, covariances: Floats | None) -> None:
        """Log what Rerun draws, if it is visibly different from what was drawn last."""
        geometry = self.column.geometry
        mesh, first = geometry if isinstance(geometry, Mesh) else None, self._shown is None
        size = points.nbytes * (2 if mesh else 1)
        change = np.inf if self._shown is None else float(np.abs(points - self._shown).max())
        if first:
            self._budget.force(size)
        elif not self._budget.allows(change, size):
            return
        self._shown = points
        body = f"{WORLD}/{self.name}/body"
        if mesh:
            normals = vertex_normals(points, mesh.faces)
            self._stream.log(body, rr.Mesh3D.from_fields(vertex_positions=points, vertex_normals=normals))
        elif isinstance(geometry, GaussianSplats):
            self._stream.log(body, rr.GaussianSplats3D.from_fields(centers=points))
            # the pose turns them; that they deform as well is seen less than that the centres do
            if self._budget.allows(change, ELLIPSOID_BYTES * len(points)) or first:
                moved = geometry.covariances if covariances is None else covariances
                self._stream.log(body, ellipsoids(moved))
        else:
            self._stream.log(body, rr.Points3D.from_fields(positions=points))

    def _show_arrows(self, motion: Motion | RecordedMotion, time: float) -> None:
        """Log the arrows that act now, when a motion begins and when one of them begins or ends to act."""
        changed = motion is not self._motion
        if changed:
            scene = find_scene(motion.schema.scene) if isinstance(motion, Motion) else None
            self._arrows = scene.glyphs(motion.parameters, self._rest) if scene is not None else ()
            obstacles = obstacles_of(motion)
            if obstacles or self._obstacles:
                log_obstacles(self._stream, f"{WORLD}/{self.name}/obstacles", obstacles)
            self._obstacles = bool(obstacles)
        acting = tuple(arrow.begin <= time <= arrow.end for arrow in self._arrows)
        if acting != self._acting or (changed and any(acting)):
            arrows = [arrow for arrow, acts in zip(self._arrows, acting, strict=True) if acts]
            log_arrows(self._stream, f"{WORLD}/{self.name}/arrows", arrows, float(np.ptp(self._rest, axis=0).max()))
        self._acting = acting

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

    def _log_status(self, shown: ColumnFrame, time: float) -> None:
        problems = [shown.stats.status] if shown.stats.status != "ok" else []
        if shown.untrained and shown.similarity:
            problems.append(shown.similarity.describe())
        if stop := shown.stop_at(time):
            problems.append(str(stop))
        status = f"{self.column.label}: {shown.stats.solver}, {'; '.join(problems) or 'ok'}"
        if status != self._status:
            level = rr.TextLogLevel.WARN if problems else rr.TextLogLevel.INFO
            self._stream.log(f"status/{self.name}", rr.TextLog(status, level=level))
            self._status = status


def _vertex_colors(mesh: Mesh) -> np.ndarray:
    """Vertex colors (N, 3) of a mesh that has colors: the mean of those at the corners of its faces."""
    assert mesh.colors is not None
    corners = np.asarray(mesh.faces).ravel()
    sums, counts = np.zeros((len(mesh.points), 3)), np.bincount(corners, minlength=len(mesh.points))
    np.add.at(sums, corners, mesh.colors.reshape(-1, 3))
    return np.round(sums / np.maximum(counts, 1)[:, None]).astype(np.uint8)


def _checkerboard(points: Points, color: Color) -> np.ndarray:
    """Vertex colors (N, 3) that alternate by octant around the centre, so that rotations are visible."""
    odd = np.prod(points - 0.5 * (points.min(axis=0) + points.max(axis=0)), axis=1) > 0.0
    return np.where(odd[:, None], color, paler(color)).astype(np.uint8)
