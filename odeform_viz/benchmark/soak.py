"""Thousands of requests at random over all panels, through the protocol, fit and unfit: what breaks, what grows?"""

import contextlib
import gc
import io
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform_viz.app import App
from odeform_viz.benchmark.client import Control, LoopbackClient
from odeform_viz.rendering.checkerboard import checkerboard_parts
from odeform_viz.session import visible_deformation

__all__ = ["Soak", "soak"]

UNFIT = (float("nan"), float("inf"), -1e9, 1e9)
NONSENSE = "nonsense"
MOMENT = 0.3  # s
CALM = 3  # s
PATIENCE = 120.0  # s; a machine may be busy with other things
TETRAHEDRON = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
WEIGHTS = {
    "Slider": 4.0,
    "Button": 1.0,
    "ButtonGroup": 1.0,
    "Dropdown": 1.0,
    "Checkbox": 1.0,
    "Text": 0.3,
    "Upload": 0.3,
}
# what takes a while or fills a disk comes seldom, and its end often
RARE = {
    "Simulate this": 0.02,
    "Map stability": 0.0,  # both cores are busy for ten seconds, in which nothing else can be measured
    "Start recording": 0.1,
    "Cancel": 3.0,
    "Stop recording": 3.0,
    "Download": 0.2,
}


@dataclass(frozen=True)
class Soak:
    """Measured after each part of the requests, once the page is at rest again.

    `newest_s` are seconds from the end of a drag until its last request is shown, infinite where it is not or something
    follows it; `resident_mb` is the memory of the process.
    """

    requests: int
    refused: int
    errors: tuple[str, ...]
    newest_s: tuple[float, ...]
    resident_mb: tuple[float, ...]
    wall_s: float

    @property
    def growth(self) -> float:
        """Of the memory from the first part, the warm-up, to the end."""
        return self.resident_mb[-1] / self.resident_mb[0] - 1.0


def soak(app: App, port: int, requests: int, folder: Path, rate: float = 40.0, parts: int = 10, seed: int = 0) -> Soak:
    """Send `requests` messages at `rate` in Hz to an app at that port; recordings go to the folder.

    After each of the `parts` the page is calmed and looked at.
    """
    rng, begin = np.random.default_rng(seed), time.monotonic()
    fresh, resident = [], []
    with _errors() as errors, LoopbackClient(port) as client:
        for _ in range(parts):
            for _ in range(requests // parts):
                _wish(client, rng, folder)
                client.collect(1.0 / rate)
            _calm(client, app)
            fresh.append(_until_newest(client, app))
            client.downloads.clear()  # the browser's, not the viewer's
            gc.collect()
            resident.append(_resident_mb())
        refused = len(client.notifications)
    return Soak(requests, refused, tuple(errors), tuple(fresh), tuple(resident), time.monotonic() - begin)


def _wish(client: LoopbackClient, rng: np.random.Generator, folder: Path) -> None:
    if rng.random() < 0.05:
        client.press(str(rng.choice(client.commands)))
        return
    controls = {label: c for label, c in client.controls.items() if c.visible and not c.props.get("disabled")}
    weights = np.array([WEIGHTS.get(c.kind, 0.3) * RARE.get(label, 1.0) for label, c in controls.items()])
    label = str(rng.choice(list(controls), p=weights / weights.sum()))
    control = controls[label]
    if control.kind == "UploadButton":
        state = next((f for n, f in client.downloads.items() if n.endswith(".json")), b"{}")
        contents = {"x.obj": TETRAHEDRON, "x.ply": b"ply\n", "x.json": state, "y.json": b'{"odeform_state": 1}'}
        name = str(rng.choice(list(contents)))
        client.upload(label, name, contents[name])
    else:
        client.set(label, _value(control, rng, folder))


def _value(control: Control, rng: np.random.Generator, folder: Path) -> Any:
    unfit = rng.random() < 0.1
    if control.kind == "Slider":
        return float(rng.choice(UNFIT) if unfit else rng.uniform(control.props["min"], control.props["max"]))
    if control.kind == "Number":
        return float(rng.choice(UNFIT) if unfit else 10.0 ** rng.uniform(-3.0, 2.0))
    if control.kind in ("Dropdown", "ButtonGroup"):
        return NONSENSE if unfit else str(rng.choice(control.props["options"]))
    if control.kind == "Vector3":
        return tuple(rng.uniform(-10.0, 110.0, 3).tolist())
    if control.kind == "Text":
        return "" if unfit else str(folder / "soak.rrd")
    return bool(rng.random() < 0.5) if control.kind == "Checkbox" else True


def _calm(client: LoopbackClient, app: App) -> None:
    """Back to how the page opened: one model at its defaults, of its own shape, paused, and so for some seconds, in
    which requests that take long come to their end."""
    end, calm = time.monotonic() + PATIENCE, 0
    while time.monotonic() < end:
        client.collect(1.0)
        calm = calm + 1 if _is_calm(app) else 0
        if calm == CALM:
            return
        if calm:
            continue
        for label in ("Cancel", "Stop recording", "Back to the trained body"):
            if client.controls[label].visible:
                client.click(label)
        client.set("reset", "all")
        client.set("test sequence", "none")
        first = next(c for c in app.columns.all if c.predictor and c.pinned is None)
        boxes = {c.label: c is first for c in app.columns.all}
        for label in boxes.keys() & client.controls.keys():  # a column's box comes, and goes, a moment after it
            client.set(label, boxes[label])
        client.collect(0.5)
        client.click("Remove hidden columns")
        client.set("quality", "balanced")
        client.set("time (s)", MOMENT)
    raise TimeoutError(f"the page did not come to rest within {PATIENCE:g} s")


def _is_calm(app: App) -> bool:
    columns, parameters = app.columns.all, app.session.schema.parameters
    try:
        request = app.request()
    except InputError:  # a slider is out of range
        return False
    return (
        len(columns) == 1
        and columns[0].predictor is not None
        and columns[0].pinned is None
        and columns[0].visible
        and columns[0].geometry is columns[0].predictor.rest
        and not app.clock.playing
        and request.time == MOMENT
        and request.quality == "balanced"
        and request.parameters == {p.name: p.default for p in parameters}
    )


def _until_newest(client: LoopbackClient, app: App) -> float:
    """Seconds from the end of a drag to the vertices of its last request; infinite unless they come, and come last."""
    column, schema = app.columns.all[0], app.session.schema
    assert column.predictor is not None
    slider = schema.parameters[0]
    values = np.linspace(slider.low, slider.high, 40)[np.random.default_rng(1).permutation(40)]
    node = f"/world/column_{column.key}/body/part_0"
    expected = visible_deformation(column.predictor.solve(column.geometry, {slider.name: float(values[-1])}), MOMENT)
    assert expected is not None, "a moment at which every ball is flattened"
    wanted = checkerboard_parts(column.predictor.rest)[0].vertices(expected)
    for value in values:
        client.set(f"{slider.name} ({slider.unit})", float(value))
    newest, begin = math.inf, time.monotonic()
    while time.monotonic() < begin + PATIENCE:
        vertices = client.wait_vertices(node, 1.0)
        if vertices is not None:
            # frames of other requests are off by a hundred times as much; a basis placed anew may round otherwise
            right = np.allclose(vertices, wanted, rtol=0.0, atol=1e-6)
            newest = time.monotonic() - begin if right else math.inf
        elif newest < math.inf:
            return newest
    return math.inf


@contextlib.contextmanager
def _errors() -> Iterator[list[str]]:
    """Collects the tracebacks that are printed meanwhile."""
    printed, found = io.StringIO(), []
    before, sys.stderr = sys.stderr, printed
    try:
        yield found
    finally:
        sys.stderr = before
        blocks = printed.getvalue().split("Traceback")[1:]
        found.extend(block.strip() for block in blocks)


def _resident_mb() -> float:
    """Of this process; Linux tells."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6
