"""Soak test: random inputs and scripted visits, from several browsers. Finds errors, stale frames, growing memory."""

import contextlib
import io
import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from odeform_figures.viewer_benchmark.allocated import allocated_mb
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_figures.viewer_benchmark.newest import seconds_to_newest
from odeform_figures.viewer_benchmark.random_input import send_random_input
from odeform_figures.viewer_benchmark.resetting import reset
from odeform_figures.viewer_benchmark.use import SCRIPTS
from odeform_figures.viewer_benchmark.visitors import Missed, Visitors
from odeform_viz.app import App

__all__ = ["GROWTH", "Soak", "soak"]

GROWTH = 0.05  # of the memory after warm-up, at most
WARM_UP = 0.2  # of the parts
BETWEEN = 1.0  # s at rest between scripts
REST = 4.0  # s at rest before memory is measured


@dataclass(frozen=True)
class Soak:
    """The result of a soak test, measured after each part of it, with the page at rest."""

    requests: int
    """Messages of all browsers."""
    refused: int
    """Notifications that refused an input."""
    errors: tuple[str, ...]
    """Tracebacks that were printed, and what scripts missed."""
    newest_s: tuple[float, ...]
    """Seconds from the end of a drag to the frame of its last message, in the last of the browsers to show it;
    infinite if one of them gets another frame last."""
    resident_mb: tuple[float, ...]
    """Resident memory of the process, the browsers' clients included."""
    allocated_mb: tuple[float, ...]
    """Allocated part of the resident memory; empty where it is not known."""
    wall_s: float

    @property
    def memory(self) -> tuple[float, float]:
        """Resident memory after warm-up and at the end, in MB.

        Each is the median of a quarter of the parts: single ones differ with what was shown last.
        """
        return _first_and_last(self.resident_mb)

    @property
    def allocated(self) -> tuple[float, float] | None:
        """Returns the same of the memory that is allocated: it grows with what is kept, and not with gaps between
        pieces."""
        return _first_and_last(self.allocated_mb) if self.allocated_mb else None

    @property
    def growth(self) -> float:
        """Relative growth of the memory after warm-up."""
        warm, last = self.memory
        return last / warm - 1.0

    @property
    def passed(self) -> bool:
        """No error, the newest frame always last, and memory that grows by less than `GROWTH`."""
        return not self.errors and all(math.isfinite(s) for s in self.newest_s) and self.growth < GROWTH


def soak(
    app: App,
    requests: int,
    folder: Path,
    rate: float = 40.0,
    parts: int = 10,
    minutes: float | None = None,
    seed: int = 0,
    report: Callable[[str], None] = lambda _: None,
) -> Soak:
    """Send `requests` random inputs to an app at `rate` Hz, in `parts`, each followed by all scripts in random order.

    With `minutes`, parts of the same size are sent until that time is over. `folder` is the workspace of the app.
    `report` is called with a line about each part.
    """
    rng, begin = np.random.default_rng(seed), time.monotonic()
    port, newest, resident, allocated = app.server.get_port(), [], [], []
    with _tracebacks() as errors, LoopbackClient(port) as first, LoopbackClient(port) as second:
        visitors = Visitors(app, (first, second), folder, rng)
        while len(resident) < parts if minutes is None else time.monotonic() < begin + 60.0 * minutes:
            for _ in range(requests // parts):
                client = visitors.clients[int(rng.integers(2))]
                send_random_input(client, rng, folder)
                visitors.collect(1.0 / rate)
            reset(visitors)
            missed = _run_scripts(visitors)
            errors.extend(missed)
            reset(visitors)
            newest.append(seconds_to_newest(visitors, visitors.clients[len(newest) % 2]))
            for client in visitors.clients:
                client.downloads.clear()  # memory of the client, not of the viewer
            visitors.collect(REST)  # in which the viewer returns what it has freed
            resident.append(_resident_mb())
            allocated.append(allocated_mb())
            line = f"{time.monotonic() - begin:.0f} s: {resident[-1]:.0f} MB, newest frame after {newest[-1]:.2f} s"
            report("; ".join([line, *missed]))
        refused = len(first.notifications)
        sent = visitors.sent + first.sent + second.sent
    known = tuple(mb for mb in allocated if mb is not None)
    return Soak(sent, refused, tuple(errors), tuple(newest), tuple(resident), known, time.monotonic() - begin)


def _first_and_last(parts: tuple[float, ...]) -> tuple[float, float]:
    warm = parts[math.ceil(WARM_UP * len(parts)) - 1 :]
    quarter = max(len(warm) // 4, 1)
    return float(np.median(warm[:quarter])), float(np.median(warm[-quarter:]))


def _run_scripts(visitors: Visitors) -> list[str]:
    """Run all scripts that the page has the controls for; returns what they missed."""
    missed, controls = [], visitors.first.controls
    usable = [script for script, needed in SCRIPTS if needed in controls and not controls[needed].props.get("disabled")]
    for index in visitors.rng.permutation(len(usable)):
        script = usable[index]
        visitors.begin()
        try:
            script(visitors)
        except (Missed, AssertionError, TimeoutError) as error:
            missed.append(f"{script.__name__}: {error}")
        missed += [f"{script.__name__}: unexpected notification {said!r}" for said in visitors.unexpected()]
        reset(visitors, BETWEEN)
    return missed


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
