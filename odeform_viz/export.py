"""The motion on the page as a file, in any format that `odeform.formats` can write."""

from pathlib import Path

import numpy as np

from odeform.errors import InputError
from odeform.formats.registry import motion_formats, shape_formats, writers
from odeform.formats.writing import shape_at, write_motion, write_shape
from odeform.motion.base import Motion
from odeform.motion.caveats import caveats
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest

__all__ = ["export", "export_formats", "export_notes"]

FILM = ".webp"


def export_formats() -> dict[str, tuple[str, bool]]:
    """Labels of the formats, their suffixes, and whether they hold the whole motion rather than the current frame.

    Films are left to the browser, which draws what it shows.
    """
    frames = {f"current frame ({suffix})": (suffix, False) for suffix in shape_formats()}
    return frames | {f"whole motion ({suffix})": (suffix, True) for suffix in motion_formats() if suffix != FILM}


def export(session: Session, request: ViewRequest, path: Path, whole: bool) -> Path:
    """Write the motion of the first visible model to `path`; returns the file.

    All frames of the trained window with `whole`, otherwise the current frame. A loaded shape is written in
    the units and axes of its file. Where the format has errors (`.csv`) and a truth is visible, they are against it.
    `InputError` without a visible model, or for a format that cannot hold the shape.
    """
    column = next((c for c in request.columns if c.visible and c.predictor), None)
    if column is None:
        raise InputError("export: no model is visible")
    truth = session.truth_of(column, request) if whole and writers()[path.suffix].compares else None
    if truth is not None:
        motion = session.new_compared_motion(column, truth, request)
        write_motion(motion, session.schema.window.times, path, truth=truth)
        return path
    motion = session.new_motion(column, request)
    if not whole:
        path = path.with_stem(f"{path.stem}_{0:05d}")
        write_shape(shape_at(motion, request.time, column.fit), path, caveats(motion, np.array([request.time])))
    else:
        write_motion(motion, session.schema.window.times, path, column.fit)
    return path


def export_notes(session: Session, request: ViewRequest, whole: bool) -> tuple[str, ...]:
    """Says what has to be known of the motion that `export` writes with `whole` or without; the file says it too."""
    column = next((c for c in request.columns if c.visible and c.predictor), None)
    motion = None if column is None else session.motion(column, request)
    times = session.schema.window.times if whole else np.array([request.time])
    return caveats(motion, times) if isinstance(motion, Motion) else ()
