"""Frames -> Rerun. One recording a session; static topology, moving positions."""

import json
from collections.abc import Sequence
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from odeform.errors import InputError
from odeform.geometry.normals import vertex_normals
from odeform.model.recorded import RecordedMotion
from odeform.types import Mesh
from odeform_viz.columns import Column
from odeform_viz.session import ColumnFrame, Frame

__all__ = ["Recorder"]

SHOWN = "shown"  # timeline: index of the frame on screen
MOTION = "motion_time"  # timeline: seconds of the motion


class Recorder:
    """Logs every published frame to a file. Use from one thread: Rerun's clock is thread-local."""

    def __init__(self, path: str | Path) -> None:
        path = Path(path)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("ab"):
                pass
        except OSError as error:
            raise InputError(f"recording {path}: cannot be written: {error.strerror}") from None
        self._stream = rr.RecordingStream("odeform")
        self._stream.save(str(path))
        self._stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self.path = path
        self.frames = 0
        self._known: dict[int, Column] = {}
        self._present: set[int] = set()

    def log(self, frame: Frame) -> None:
        self._stream.set_time(SHOWN, sequence=self.frames)
        self._stream.set_time(MOTION, duration=frame.wish.time)
        self.frames += 1
        for name, value in frame.wish.parameters.items():
            self._stream.log(f"parameters/{name}", rr.Scalars(value))
        fresh = [shown.column for shown in frame.columns if shown.column.key not in self._known]
        for column in fresh:
            self._known[column.key] = column
            self._log_static(column)
        if fresh:
            self._stream.send_blueprint(_blueprint(list(self._known.values())), make_default=True)
        present = {shown.column.key for shown in frame.columns}
        for key in self._present - present:
            self._stream.log(f"world/{self._known[key].label}", rr.Clear(recursive=True))
        self._present = present
        for shown in frame.columns:
            self._log_column(shown.column, shown, frame.wish.time)

    def _log_static(self, column: Column) -> None:
        provenance = _provenance(column)
        text = rr.TextDocument(f"```json\n{json.dumps(provenance, indent=1)}\n```", media_type=rr.MediaType.MARKDOWN)
        self._stream.log(f"provenance/{column.label}", text, static=True)
        geometry = column.geometry
        if isinstance(geometry, Mesh):
            self._stream.log(
                f"world/{column.label}/body",
                rr.Mesh3D.from_fields(triangle_indices=geometry.faces, albedo_factor=[236, 112, 60, 255]),
                static=True,
            )

    def _log_column(self, column: Column, shown: ColumnFrame, time: float) -> None:
        path = f"world/{column.label}/body"
        points = shown.motion.deformed(time) if shown.points is None else shown.points
        if isinstance(column.geometry, Mesh):
            normals = vertex_normals(points, column.geometry.faces)
            self._stream.log(path, rr.Mesh3D.from_fields(vertex_positions=points, vertex_normals=normals))
        else:
            self._stream.log(path, rr.Points3D(points))
        pose = shown.pose
        self._stream.log(path, rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))
        stats = shown.stats
        numbers = {
            "evaluations": stats.evaluations,
            "solve_ms": stats.wall_ms,
            "solver_error_mm": stats.solver_error_mm,
            "height_m": float((pose[:3, :3] @ points.mean(axis=0) + pose[:3, 3])[2]),
        }
        for name, value in numbers.items():
            if value is not None:
                self._stream.log(f"statistics/{column.label}/{name}", rr.Scalars(value))

    def close(self) -> None:
        self._stream.flush()
        self._stream.disconnect()


def _provenance(column: Column) -> dict[str, object]:
    if isinstance(column.source, RecordedMotion):
        return {"label": column.label, "model": "recorded", "parameters": dict(column.source.parameters)}
    checkpoint = column.source.checkpoint
    return {
        "label": column.label,
        "model": checkpoint.model,
        "sha256": checkpoint.sha256,
        "pinned": None if column.pinned is None else dict(column.pinned),
        "schema": checkpoint.schema.to_json(),
        "provenance": checkpoint.provenance,
        "scores": {k: v for k, v in checkpoint.scores.items() if k != "per_frame_rmse_mm"},
    }


def _blueprint(columns: Sequence[Column]) -> rrb.Blueprint:
    views = [
        rrb.Spatial3DView(origin="world", contents=[f"world/{column.label}/**"], name=column.label)
        for column in columns
    ]
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(*views),
            rrb.Horizontal(
                rrb.TimeSeriesView(origin="parameters", name="parameters"),
                rrb.TimeSeriesView(origin="statistics", name="statistics"),
                rrb.TextDocumentView(origin=f"provenance/{columns[0].label}", name="provenance"),
            ),
            row_shares=[3, 2],
        ),
        rrb.TimePanel(timeline=SHOWN, state="collapsed"),
        collapse_panels=True,
    )
