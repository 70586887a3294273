"""A shape of one's own on the page: the time to its first motion, and the latency of a slider while it is taught."""

import contextlib
import json
import struct
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from odeform.errors import InputError
from odeform.geometry.split_colors import split_colors
from odeform.models.base import Predictor
from odeform.types import Floats, Mesh, Points
from odeform_figures.opened_page import CHROMIUM, FLAGS, opened
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_figures.viewer_benchmark.latency import DRAG_RATE, latencies
from odeform_viz.app import App
from odeform_viz.columns import Column
from odeform_viz.rendering.checkerboard import checkerboard_parts

__all__ = ["drag_while_teaching"]

MOMENT = 0.05  # s; bodies are deformed then
FORCE = "force (N)"
PART = 60  # messages of a drag, after which it is looked up how far the lesson is
PATIENCE = 900.0  # s, for a busy machine
SIZE = (1200, 800)  # px
TAUGHT, LEARNING = "Taught in", "Learning from"  # in the text of a lesson


def drag_while_teaching(model: Predictor, origin: str, file: Path, motions: int, browser: bool) -> dict[str, float]:
    """Loads the mesh in a file, and drags the slider of the force: before a lesson, while its motions are simulated,
    while the model learns, and (`ending`) while the refined model comes to stand beside the first guess.

    `first_motion_s` is from the upload to the first frame of the shape. With `browser`, Chromium shows the page.
    `InputError` for a shape that is refused or cannot be taught.
    """
    with _page(Column(model.model, model, model.rest, origin=origin), browser) as (app, client):
        found = {"first_motion_s": _load(app, client, file)}
        drag = _dragging(app, client)
        waits: dict[str, list[Floats]] = {"before": [drag()], "simulating": [], "learning": [], "ending": []}
        begin = time.perf_counter()
        client.set("motions", str(motions))
        client.click("Teach this shape")
        while TAUGHT not in client.text():
            if client.notifications or time.perf_counter() > begin + PATIENCE:
                raise InputError(f"{file}: not taught: {client.notifications}")
            phase = "learning" if LEARNING in client.text() else "simulating"
            taken = drag()
            waits["ending" if TAUGHT in client.text() else phase].append(taken)
        found["taught_s"] = time.perf_counter() - begin
        waits["ending"].append(drag())
    for phase, parts in waits.items():
        together = np.nan_to_num(np.concatenate(parts or [np.zeros(0)]), nan=np.inf)  # of what was never answered
        found[f"{phase}_messages"] = len(together)
        for percent in (50, 95, 100) if len(together) else ():
            found[f"{phase}_p{percent}_ms"] = 1e3 * float(np.percentile(together, percent))
    return found


@contextlib.contextmanager
def _page(column: Column, browser: bool) -> Iterator[tuple[App, LoopbackClient]]:
    """The page and a client of it; with `browser`, Chromium shows it too."""
    if browser:
        from playwright.sync_api import sync_playwright  # of the development dependencies

        with sync_playwright() as playwright:
            chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            with opened(chromium, [column], SIZE) as view:
                yield view.app, view.client
            chromium.close()
        return
    with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
        app = App([column], port=0, workspace=folder)
        try:
            with LoopbackClient(app.server.get_port()) as client:
                yield app, client
        finally:
            app.close()


def _load(app: App, client: LoopbackClient, file: Path) -> float:
    """Seconds from the upload of a file to the first frame of its shape."""
    client.set("time (s)", MOMENT)
    client.collect(2.0)
    begin = time.perf_counter()
    client.upload("Load a shape...", file.name, file.read_bytes())

    def shown() -> bool:
        frame = app.presenter.frame
        return frame is not None and frame.columns[0].column.loaded

    if not client.until(lambda: shown() or bool(client.notifications), PATIENCE) or not shown():
        raise InputError(f"{file}: not loaded: {client.notifications}")
    taken = time.perf_counter() - begin
    client.collect(2.0)  # the page goes to the start of the motion, after the shape is there
    client.set("time (s)", MOMENT)
    if not client.until(lambda: app.clock.time() == MOMENT and app.presenter.settled):
        raise InputError(f"expected the page at {MOMENT:g} s, it is at {app.clock.time():g} s")
    return taken


def _dragging(app: App, client: LoopbackClient) -> Callable[[], Floats]:
    """What drags the slider up to the strongest known force, and returns the seconds to the answer of each message."""
    column, given = app.columns.all[0], app.request().parameters
    model, shape = column.predictor, column.geometry
    if model is None or not isinstance(shape, Mesh):
        raise InputError("expected a mesh that the model moves")
    values = np.linspace(*model.force_range(given), PART)
    colored, part = split_colors(shape), checkerboard_parts(shape)[-1]
    force = np.array([given[name] for name in ("force_x", "force_y", "force_z")])
    force /= np.linalg.norm(force)

    def sent(points: Points) -> Points:
        return part.vertices(points) if colored is None else points[colored.vertices]

    pushes = ({**given, **dict(zip(("force_x", "force_y", "force_z"), v * force, strict=True))} for v in values)
    expected = np.stack([sent(model.solve(shape, push).deformed(MOMENT)) for push in pushes])

    def wait(seconds: float) -> int | None:
        points = _body_in(client, seconds)
        return None if points is None else int(np.abs(expected - points).sum(axis=(1, 2)).argmin())

    return lambda: latencies(values, lambda v: client.set(FORCE, v), wait, DRAG_RATE)[0]


def _body_in(client: LoopbackClient, seconds: float) -> Points | None:
    """(N, 3) m of the next update of the first column's body: of the last part of a mesh that has no colours, or of one
    that has."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        for message in client.receive(left) or []:
            updates, node = message.get("updates", {}), str(message.get("name"))
            if not node.startswith("/world/column_0/body"):
                continue
            if "glb_data" in updates:
                return _positions(bytes(updates["glb_data"]))
            if "vertices" in updates and node.endswith("part_1"):
                return updates["vertices"].reshape(-1, 3)
    return None


def _positions(data: bytes) -> Points:
    """(N, 3) m of a binary glTF of the page, which begins with them."""
    (length,) = struct.unpack_from("<I", data, 12)
    count = json.loads(data[20 : 20 + length])["accessors"][0]["count"]
    return np.frombuffer(data, np.float32, 3 * count, 28 + length).reshape(-1, 3)
