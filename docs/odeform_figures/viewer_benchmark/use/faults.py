"""Faults of the machine in the middle of use: killed processes, a full disk, a clock that jumps."""

import multiprocessing
import random
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.process import BaseProcess

from odeform_figures.viewer_benchmark.client import DEADLINE
from odeform_figures.viewer_benchmark.use.fits import CANCEL, STEP, choose_truth
from odeform_figures.viewer_benchmark.use.fits import START as FIT
from odeform_figures.viewer_benchmark.use.recordings import stop_recording
from odeform_figures.viewer_benchmark.use.simulations import START as SIMULATE
from odeform_figures.viewer_benchmark.visitors import Visitors
from odeform_viz.panels.truth import NONE
from odeform_viz.runtime.jobs import JOB

__all__ = ["fill_disk", "kill_fit", "kill_simulator", "set_clock"]

KILLED = "the process was ended by SIGKILL"
FULL = "can no longer be written (File too large"
ROOM = 100_000  # bytes in a file, from which on the disk counts as full
JUMPS = (-1e7, -3600.0, 0.0, 3600.0, 1e9)  # s


def kill_simulator(visitors: Visitors) -> None:
    """Kill the process of a simulation; the page says so, and another one can be started."""
    visitors.first.click(SIMULATE)
    visitors.expect("a process of the simulator", lambda: bool(_jobs()))
    visitors.expect_control("Cancel")
    _kill_processes()
    _expect_text(visitors, f"**The simulation failed**: {KILLED}")
    visitors.expect_control(SIMULATE)
    visitors.drag(visitors.second, 5)


def kill_fit(visitors: Visitors) -> None:
    """Kill the process of a fit; the page says so, and another one can be started."""
    choose_truth(visitors)
    visitors.first.click(FIT)
    visitors.expect("steps of a fit", lambda: STEP in visitors.first.text())
    visitors.expect_control(CANCEL)
    _kill_processes()
    _expect_text(visitors, f"**The fit failed**: {KILLED}")
    visitors.expect_control(FIT)
    visitors.first.set("test sequence", NONE)


def fill_disk(visitors: Visitors) -> None:
    """Record until the disk is full; the page says why the recording ended, and everything else goes on."""
    with _full_disk(), _recording(visitors, "full.rrd"):
        # a recording is written while there are frames
        end = time.monotonic() + DEADLINE
        while not _says(visitors, FULL) and time.monotonic() < end:
            visitors.drag(visitors.second, 5)
        _expect_text(visitors, FULL)
        visitors.drag(visitors.second, 5)
        visitors.expect_control("Start recording")


def set_clock(visitors: Visitors) -> None:
    """Play and record while the wall clock jumps by hours and years."""
    with _jumping_clock(), _recording(visitors, "jumps.rrd"):
        visitors.drag(visitors.second, 10)
        began = visitors.app.clock.time()
        visitors.first.click("Play")
        visitors.expect("time to go on", lambda: visitors.app.clock.time() != began)
        stop_recording(visitors)


@contextmanager
def _recording(visitors: Visitors, name: str) -> Iterator[None]:
    """Begins with a recording that has started; its file is gone at the end."""
    path = visitors.folder / name
    path.unlink(missing_ok=True)
    visitors.first.set("file", name)
    visitors.first.click("Start recording")
    visitors.expect_control("Stop recording")
    yield
    path.unlink(missing_ok=True)  # a disk that is full from the start leaves none


def _expect_text(visitors: Visitors, part: str) -> None:
    visitors.expect(f"{part!r} in all browsers", lambda: _says(visitors, part))


def _says(visitors: Visitors, part: str) -> bool:
    return all(part in client.text() for client in visitors.clients)


def _kill_processes() -> None:
    for process in _jobs():
        process.kill()


def _jobs() -> list[BaseProcess]:
    """The viewer's own: libraries keep processes too."""
    return [process for process in multiprocessing.active_children() if process.name == JOB]


@contextmanager
def _full_disk() -> Iterator[None]:
    """No file of this process may grow beyond `ROOM`: the same error to a program as that of a full disk."""
    import resource  # there is none on Windows

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@contextmanager
def _jumping_clock() -> Iterator[None]:
    """Python's wall clock is wrong by another of `JUMPS` each time it is read."""
    now, rng = time.time, random.Random(0)
    time.time = lambda: now() + rng.choice(JUMPS)
    try:
        yield
    finally:
        time.time = now
