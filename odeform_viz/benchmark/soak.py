"""Soak test: thousands of random inputs through the protocol. Finds errors, stale frames and growing memory."""

import contextlib
import gc
import io
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from odeform.errors import InputError
from odeform_viz.app import App
from odeform_viz.benchmark.client import LoopbackClient
from odeform_viz.benchmark.random_input import send_random_input
from odeform_viz.rendering.checkerboard import checkerboard_parts
from odeform_viz.session import visible_deformation

__all__ = ["Soak", "soak"]

MOMENT = 0.3  # s; bundled scenes with an impact are deformed then
REST = 3  # s without a change after which the page counts as at rest
DEADLINE = 120.0  # s, for a busy machine


@dataclass(frozen=True)
class Soak:
    """The result of a soak test, measured after each part of it, with the page at rest."""

    requests: int
    refused: int
    """Notifications that refused an input."""
    errors: tuple[str, ...]
    """Tracebacks that were printed."""
    newest_s: tuple[float, ...]
    """Seconds from the end of a drag to the frame of its last message; infinite if another frame comes last."""
    resident_mb: tuple[float, ...]
    """Resident memory of the process."""
    wall_s: float

    @property
    def growth(self) -> float:
        """Relative growth of the memory from the first part, the warm-up, to the last."""
        return self.resident_mb[-1] / self.resident_mb[0] - 1.0


def soak(app: App, requests: int, folder: Path, rate: float = 40.0, parts: int = 10, seed: int = 0) -> Soak:
    """Send `requests` random inputs to an app at `rate` Hz, in `parts`; recordings are put into `folder`."""
    rng, begin = np.random.default_rng(seed), time.monotonic()
    newest, resident = [], []
    with _tracebacks() as errors, LoopbackClient(app.server.get_port()) as client:
        for _ in range(parts):
            for _ in range(requests // parts):
                send_random_input(client, rng, folder)
                client.collect(1.0 / rate)
            _reset(client, app)
            newest.append(_seconds_to_newest(client, app))
            client.downloads.clear()  # memory of the client, not of the viewer
            gc.collect()
            resident.append(_resident_mb())
        refused = len(client.notifications)
    return Soak(requests, refused, tuple(errors), tuple(newest), tuple(resident), time.monotonic() - begin)


def _reset(client: LoopbackClient, app: App) -> None:
    """Bring the page back to one model with default parameters and its own shape, paused, and wait until it rests."""
    end, rested = time.monotonic() + DEADLINE, 0
    while time.monotonic() < end:
        client.collect(1.0)
        rested = rested + 1 if _is_reset(app) else 0
        if rested == REST:
            return
        if rested:
            continue
        for label in ("Cancel", "Stop recording", "Back to the trained body"):
            if client.controls[label].visible:
                client.click(label)
        client.set("reset", "all")
        client.set("test sequence", "none")
        first = next(c for c in app.columns.all if c.predictor and c.pinned is None)
        boxes = {c.label: c is first for c in app.columns.all}
        for label in boxes.keys() & client.controls.keys():  # the checkbox of a column appears a moment after it
            client.set(label, boxes[label])
        client.collect(0.5)
        client.click("Remove hidden columns")
        client.set("quality", "balanced")
        client.set("time (s)", MOMENT)
    raise TimeoutError(f"the page did not come to rest within {DEADLINE:g} s")


def _is_reset(app: App) -> bool:
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


def _seconds_to_newest(client: LoopbackClient, app: App) -> float:
    """Seconds from the end of a drag to the vertices of its last message; infinite unless they come, and come last."""
    column, schema = app.columns.all[0], app.session.schema
    assert column.predictor is not None
    slider = schema.parameters[0]
    values = np.linspace(slider.low, slider.high, 40)[np.random.default_rng(1).permutation(40)]
    node = f"/world/column_{column.key}/body/part_0"
    deformed = visible_deformation(column.predictor.solve(column.geometry, {slider.name: float(values[-1])}), MOMENT)
    assert deformed is not None, "expected a time at which the body is deformed"
    expected = checkerboard_parts(column.predictor.rest)[0].vertices(deformed)
    for value in values:
        client.set(f"{slider.name} ({slider.unit})", float(value))
    newest, begin = math.inf, time.monotonic()
    while time.monotonic() < begin + DEADLINE:
        vertices = client.wait_vertices(node, 1.0)
        if vertices is not None:
            # frames of other values differ by a hundred times as much; rounding may differ after a new basis
            agrees = np.allclose(vertices, expected, rtol=0.0, atol=1e-6)
            newest = time.monotonic() - begin if agrees else math.inf
        elif newest < math.inf:
            return newest
    return math.inf


@contextlib.contextmanager
def _tracebacks() -> Iterator[list[str]]:
    """A list that holds, at the end, the tracebacks printed meanwhile."""
    printed, found = io.StringIO(), []
    before, sys.stderr = sys.stderr, printed
    try:
        yield found
    finally:
        sys.stderr = before
        blocks = printed.getvalue().split("Traceback")[1:]
        found.extend(block.strip() for block in blocks)


def _resident_mb() -> float:
    """Resident memory of this process (Linux only)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6
