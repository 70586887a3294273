"""Brings the page back to one model with default parameters, so that what follows can be compared."""

import sys
import threading
import time

from odeform.errors import InputError
from odeform.schema import OBJECT
from odeform_figures.viewer_benchmark.visitors import Visitors
from odeform_viz.app import App
from odeform_viz.columns import Column

__all__ = ["are_callbacks_done", "moment_of", "reset"]

LATEST = 0.3  # s; bundled scenes with an impact are deformed then
SETTINGS = {"colour by": "own colours", "exaggerate": 1.0, "ghost": False, "wireframe": False, "loop": True}
ENDINGS = ("Cancel", "Cancel the fit", "Cancel the film", "Stop recording")
BACK = ("Back to the trained body", "Back to the trained bodies")
DEADLINE = 120.0  # s, for a busy machine
POOLS = ("ThreadPoolExecutor-", "asyncio_")  # names of the threads that callbacks run in


def moment_of(app: App) -> float:
    """A time in seconds at which bodies are deformed."""
    window = app.session.schema.window
    return min(LATEST, 0.5 * (window.start + window.stop))


def reset(visitors: Visitors, rest: float = 3.0) -> None:
    """End all work, and show one model with default parameters and its own shape, paused at `moment_of` it.

    Returns once nothing has changed for `rest` seconds. `TimeoutError` if that does not happen.
    """
    app, client, rested = visitors.app, visitors.first, 0.0
    end, turn = time.monotonic() + DEADLINE, rest / 3.0
    while time.monotonic() < end:
        visitors.collect(turn)
        rested = rested + turn if are_callbacks_done() and _is_reset(app) else 0.0
        if rested >= rest - 1e-9:
            return
        if rested:
            continue
        for label in (*ENDINGS, *BACK):
            if label in client.controls and client.controls[label].visible:
                client.click(label)
        for label, value in {**SETTINGS, **_defaults(app)}.items():
            if label in client.controls:
                client.set(label, value)
        first = next(c for c in app.columns.all if c.predictor and c.pinned is None)
        boxes = {c.label: c is first for c in app.columns.all}
        for label in boxes.keys() & client.controls.keys():  # the checkbox of a column appears a moment after it
            client.set(label, boxes[label])
        visitors.collect(0.5)
        client.click("Remove hidden columns")
        client.set("quality", "balanced")
        client.set("time (s)", moment_of(app))
    raise TimeoutError(f"the page did not come to rest within {DEADLINE:g} s")


def _defaults(app: App) -> dict[str, str]:
    """Values of the controls that set parameters."""
    objects = app.session.schema.objects
    pushed = {"object": objects[0], "set to": "defaults"} if objects else {}
    return {"reset": "all", **pushed, "test sequence": "none"}


def _is_reset(app: App) -> bool:
    columns = app.columns.all
    try:
        request = app.request()
    except InputError:  # a slider is out of range
        return False
    return (
        len(columns) == 1
        and _is_plain(columns[0])
        and not app.clock.playing
        and request.time == moment_of(app)
        and request.quality == "balanced"
        and request.parameters == _default_parameters(app, columns[0])
    )


def are_callbacks_done() -> bool:
    """Whether no callback of the page is running or waits for another: what was clicked would happen later."""
    frames = sys._current_frames()
    pooled = [frames.get(t.ident or 0) for t in threading.enumerate() if t.name.startswith(POOLS)]
    return all(frame is None or frame.f_code.co_name == "_worker" for frame in pooled)


def _is_plain(column: Column) -> bool:
    return column.predictor is not None and column.pinned is None and column.visible and not column.loaded


def _default_parameters(app: App, column: Column) -> dict[str, object]:
    schema = app.session.schema
    if schema.objects and column.predictor is not None:
        return dict(column.predictor.complete({OBJECT: schema.objects[0]}))
    return {p.name: p.default for p in schema.parameters}
