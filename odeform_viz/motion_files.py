"""Whole motions in the formats of the libraries that the viewer draws with: Rerun recordings and pages of viser.

The library finds these writers by the entry points `odeform.motion_writers`.
"""

import html
import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import numpy as np

from odeform.geometry.shape import FittedShape
from odeform.models.titles import subject_of
from odeform.motion.base import Motion
from odeform.motion.caveats import caveats
from odeform.schema import OBJECT
from odeform.types import GaussianSplats, Times
from odeform_viz.columns import Column
from odeform_viz.recording.writer import Recorder
from odeform_viz.rendering.scene import SceneView
from odeform_viz.runtime.access import Access
from odeform_viz.runtime.server import open_server, stop_server
from odeform_viz.session import visible_deformation
from odeform_viz.view import ColumnFrame, DisplayOptions, Frame, ViewRequest
from odeform_viz.words import parameter_title, unit_text

__all__ = ["write_html", "write_rrd"]

BANNER = (
    '<div style="position:fixed;right:16px;top:16px;max-width:34em;padding:10px 14px;border-radius:8px;z-index:10;'
    'background:#fffd;box-shadow:0 1px 4px #0003;font:14px/1.45 system-ui,sans-serif;color:#222">{}</div>'
)


def write_rrd(file: IO[bytes], motion: Motion, times: Times, fit: FittedShape | None) -> None:
    """Writes a Rerun recording of the motion at `times` (T,) s: the body with the floor and forces, and curves.

    It has the entities of the viewer's recordings. Its model is in no file of its own, so that it cannot be replayed.
    """
    with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
        path = Path(folder) / "motion.rrd"
        recorder = Recorder(path)
        try:
            for frame in _frames(motion, times, fit):
                recorder.log(frame)
            for note in caveats(motion, times):
                recorder.note(note)
            recorder.close()
        finally:
            recorder.abandon()  # if a frame could not be logged
        with path.open("rb") as whole:
            shutil.copyfileobj(whole, file)


def write_html(file: IO[bytes], motion: Motion, times: Times, fit: FittedShape | None) -> None:
    """Writes a page that plays the motion at `times` (T,) s in any browser, at its own speed, without a server.

    A caption names the scene and the parameters, and says what lies outside of what was trained.
    """
    server = open_server(Access(), 0, "ODeform")
    try:
        extent = float(np.ptp(np.asarray(motion.geometry.points), axis=0).max())
        scene = SceneView(server, extent, wake=lambda: None)
        frames = _frames(motion, times, fit)
        scene.publish(next(frames), DisplayOptions(), None)
        serializer = server.get_scene_serializer()
        for step, frame in zip(np.diff(times), frames, strict=True):
            serializer.insert_sleep(max(float(step), 0.0))
            scene.publish(frame, DisplayOptions(), None)
        page = serializer.as_html()
    finally:
        stop_server(server)
    page = re.sub(r"<title>[^<]*</title>", f"<title>{html.escape(_title(motion))}</title>", page, count=1)
    head, body, rest = page.partition("</body>")
    file.write(f"{head}{BANNER.format(_caption(motion, times))}{body}{rest}".encode())


def _frames(motion: Motion, times: Times, fit: FittedShape | None) -> Iterator[Frame]:
    column = Column(motion.schema.scene, motion, motion.geometry, fit=fit, key=0, color_index=0)
    for time in np.asarray(times, dtype=float):
        points = visible_deformation(motion, time)
        splats = points is not None and isinstance(motion.geometry, GaussianSplats)
        covariances = motion.deformed_covariances(time) if splats else None
        shown = ColumnFrame(column, motion, points, covariances, motion.placement(time), 0.0, None, time)
        yield Frame(ViewRequest(motion.parameters, float(time), "", (column,)), (shown,))


def _title(motion: Motion) -> str:
    return f"{subject_of(motion.schema.scene, str(motion.parameters.get(OBJECT, '')))} · ODeform"


def _caption(motion: Motion, times: Times) -> str:
    values = [
        f"{parameter_title(p)} {motion.parameters[p.name]:.4g} {unit_text(p.unit)}".strip()
        for p in motion.schema.parameters
    ]
    subject = subject_of(motion.schema.scene, str(motion.parameters.get(OBJECT, "")))
    span = f"{times[0]:.3g} to {times[-1]:.3g} s, lengths in metres"
    lines = [f"<b>{html.escape(subject)}</b>, {span}", html.escape(", ".join(values))]
    lines += [f'<span style="color:#b3261e">{html.escape(note)}</span>' for note in caveats(motion, times)]
    return "<br>".join(lines)
