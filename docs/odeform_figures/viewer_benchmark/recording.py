"""The size of a recording of playback, and how exactly it replays."""

import time
from pathlib import Path

from odeform.benchmark.probes import round_mesh
from odeform.models.base import Predictor
from odeform_viz.columns import Column, Columns
from odeform_viz.presenter import TICK
from odeform_viz.recording.reader import read_recording
from odeform_viz.recording.replay import check_recording
from odeform_viz.recording.writer import Recorder
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest

__all__ = ["record_playback"]

SPEED = 0.2  # s of motion per s; that of the page when it opens


def record_playback(model: Predictor, origin: str, seconds: float, points: int, folder: Path) -> dict[str, float]:
    """Record `seconds` of playback in a loop, of a round mesh of `points`, to a file in `folder`, and replay it.

    `origin` is the checkpoint's name or path.
    """
    schema, columns = model.schema, Columns.of([Column("model", model, round_mesh(points, model), origin=origin)]).all
    session, recorder, logging = Session(schema), Recorder(folder / "playback.rrd"), 0.0
    for frame in range(round(seconds / TICK)):
        moment = schema.window.start + (frame * TICK * SPEED) % (schema.window.stop - schema.window.start)
        shown = session.frame(ViewRequest(schema.complete({}), moment, "balanced", columns))
        begin = time.perf_counter()
        recorder.log(shown)
        logging += time.perf_counter() - begin
    recorder.close()
    (checked,) = check_recording(read_recording(recorder.path))
    return {
        "points": float(len(columns[0].geometry.points)),
        "frames": float(recorder.frames),
        "replayed frames": float(checked.frames),
        "size_mb": recorder.path.stat().st_size / 1e6,
        "largest_off_m": checked.error,
        "ms_per_frame": 1e3 * logging / recorder.frames,
    }
