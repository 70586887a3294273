"""The motion on the page as a file, in any format that `odeform.formats` can write."""

from pathlib import Path

from odeform.errors import InputError
from odeform.formats.registry import motion_formats, shape_formats
from odeform.formats.writing import shape_at, write_motion, write_shape
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest

__all__ = ["export", "export_formats"]


def export_formats() -> dict[str, str]:
    """Labels of the formats, and their suffixes: of the current frame, or of the whole motion in one file."""
    frames = {f"current frame ({suffix})": suffix for suffix in shape_formats()}
    return frames | {f"whole motion ({suffix})": suffix for suffix in motion_formats() if suffix not in shape_formats()}


def export(session: Session, request: ViewRequest, path: Path) -> Path:
    """Write the motion of the first visible model to `path`; returns the file.

    Formats of one shape get the current frame, others all frames of the trained window. A loaded shape is written in
    the units and axes of its file. `InputError` without a visible model, or for a format that cannot hold the shape.
    """
    column = next((c for c in request.columns if c.visible and c.predictor), None)
    if column is None:
        raise InputError("export: no model is visible")
    motion = session.new_motion(column, request)
    if path.suffix in shape_formats():
        path = path.with_stem(f"{path.stem}_{0:05d}")
        write_shape(shape_at(motion, request.time, column.fit), path)
    else:
        write_motion(motion, session.schema.window.times, path, column.fit)
    return path
