"""Faults of the machine during use: killed processes, a full disk, no home, a clock that jumps, tabs that close."""

import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from odeform.dataset.store import open_dataset
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.panels import fit, truth
from odeform_viz.panels.fit import FitPanel
from odeform_viz.panels.truth import TruthPanel, entry_label
from odeform_viz.recording.reader import read_recording
from odeform_viz.runtime.jobs import Job, Report

pytestmark = pytest.mark.slow

View = tuple[App, LoopbackClient]
ENTRY = open_dataset("mass-elastic").select("test")[2]
KILLED = "the process was ended by SIGKILL"


def endless_simulation(report: Report, *_: object) -> None:
    """In this module, for the job's process to find it."""
    while True:
        report(0.5)
        time.sleep(0.01)


def endless_fit(report: Report, *_: object) -> None:
    while True:
        report(({"mass": 0.6, "bending": 0.5}, 3.0))
        time.sleep(0.01)


def _open(app: App, client: LoopbackClient) -> None:
    client.set("test sequence", entry_label(ENTRY, app.session.schema))
    assert client.until(lambda: not client.controls["Fit to the truth"].props["disabled"])


def _kill(job: Job | None) -> None:
    assert job is not None
    assert job._process.pid is not None
    os.kill(job._process.pid, signal.SIGKILL)


def test_a_killed_simulator_is_reported_and_can_be_started_again(
    dropped: View, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, client = dropped
    monkeypatch.setattr(truth, "simulate_motion", endless_simulation)
    for _ in range(2):
        client.click("Simulate this")
        assert client.until(lambda: app.panel(TruthPanel)._bar.value == 50.0)
        _kill(app.panel(TruthPanel)._job)
        assert client.until(lambda: f"**The simulation failed**: {KILLED}" in client.text())
        assert client.until(lambda: client.controls["Simulate this"].visible)
        assert client.until(lambda: not client.controls["Cancel"].visible)


def test_a_killed_fit_is_reported_and_can_be_started_again(dropped: View, monkeypatch: pytest.MonkeyPatch) -> None:
    app, client = dropped
    _open(app, client)
    monkeypatch.setattr(fit, "fit_parameters", endless_fit)
    for _ in range(2):
        client.click("Fit to the truth")
        assert client.until(lambda: "of what is expected: 3" in client.text())
        _kill(app.panel(FitPanel)._job)
        assert client.until(lambda: f"**The fit failed**: {KILLED}" in client.text())
        assert client.until(lambda: client.controls["Fit to the truth"].visible)


def test_the_fit_of_a_closed_tab_goes_on_for_others_and_leaves_nothing(dropped: View, port: int) -> None:
    app, client = dropped
    _open(app, client)
    with LoopbackClient(port) as other:
        other.click("Fit to the truth")
        assert client.until(lambda: client.controls["Cancel the fit"].visible)
        other.vanish()
    assert client.until(lambda: "Mean square difference" in client.text())
    assert client.until(lambda: client.controls["Set sliders to the estimate"].visible)
    job = app.panel(FitPanel)._job
    assert job is not None
    job._process.join(60.0)
    job._thread.join(60.0)
    assert not job._process.is_alive()
    assert not job._thread.is_alive()
    assert client.until(lambda: len(app.server.get_clients()) == 1)


@pytest.fixture
def full_disk() -> Iterator[None]:
    """Limit files to 20 kB, as a full disk would."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("work", ["shape", "motion", "upload", "recording", "simulation"])
def test_a_full_disk_is_one_line_and_the_page_goes_on(
    dropped: View, full_disk: None, tmp_path: Path, work: str
) -> None:
    app, client = dropped
    if work in ("shape", "motion"):
        client.set("format", "current frame (.obj)" if work == "shape" else "whole motion (.npz)")
        client.click("Download")
        assert client.until(lambda: any("File too large" in said for said in client.notifications))
        assert client.downloads == {}
    elif work == "upload":
        client.upload("Load a shape...", "big.obj", b"# comment\n" * 5000)
        assert client.until(lambda: any("File too large" in said for said in client.notifications))
    elif work == "recording":
        client.set("file", "full.rrd")
        client.click("Start recording")
        client.press("Play or pause")
        assert client.until(lambda: "can no longer be written (File too large" in client.text())
        assert client.until(lambda: client.controls["Start recording"].visible)
        assert read_recording(tmp_path / "full.rrd").frames is None
    else:  # in memory, so that it needs no disk
        client.click("Simulate this")
        assert client.until(lambda: len(app.columns.all) == 2, 240.0)
        assert client.until(lambda: client.controls["Simulate this"].visible)
    client.set("mass (kg)", 0.9)
    client.set("time (s)", 0.4)
    assert client.until(lambda: _shown(app) == (0.9, 0.4) and app.presenter.settled)


def test_a_clock_that_jumps_changes_nothing(dropped: View, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now, rng = time.time, random.Random(0)
    monkeypatch.setattr(time, "time", lambda: now() + rng.choice((-1e7, -3600.0, 0.0, 3600.0, 1e9)))
    app, client = dropped
    client.set("file", "jumps.rrd")
    client.click("Start recording")
    assert client.until(lambda: client.controls["Stop recording"].visible)
    client.press("Play or pause")
    assert client.until(lambda: app.clock.playing and app.clock.time() != 0.3)
    for value in (0.6, 0.7, 0.9):
        client.set("mass (kg)", value)
    client.set("time (s)", 0.4)
    assert client.until(lambda: _shown(app) == (0.9, 0.4) and app.presenter.settled)
    client.click("Stop recording")
    assert client.until(lambda: client.controls["Start recording"].visible and not app.recording.active)
    recording = read_recording(tmp_path / "jumps.rrd")
    assert recording.frames == len(recording.requests) > 1
    assert list(recording.requests) == sorted(recording.requests)
    client.click("Download")
    assert client.until(lambda: bool(client.downloaded(".ply")))


def _shown(app: App) -> tuple[float, float] | None:
    """Mass and time of the frame on screen."""
    frame = app.presenter.frame
    return None if frame is None else (frame.request.parameters["mass"], frame.request.time)


SERVED = """
import odeform
from odeform_viz.app import App
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.columns import Column
model = odeform.load("mass-elastic/pod-rbf")
app = App([Column("pod-rbf", model, model.rest, origin="mass-elastic/pod-rbf")], port=0)
with LoopbackClient(app.server.get_port()) as client:
    client.click("Download")
    assert client.until(lambda: bool(client.downloaded(".ply"))), client.notifications
    assert client.until(lambda: app.presenter.frame is not None)
app.close()
"""


@pytest.mark.parametrize("home", ["/proc/self", "/nowhere", None])
def test_no_home_is_needed(home: str | None, tmp_path: Path) -> None:
    """One that is read-only, one that does not exist, and none."""
    environment = {k: v for k, v in os.environ.items() if k != "HOME" and not k.startswith("XDG_")}
    environment |= {"HOME": home} if home else {}
    command = [sys.executable, "-c", SERVED]
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=240.0)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_port_that_is_taken_is_one_line(dropped: View, port: int) -> None:
    command = [sys.executable, "-m", "odeform_viz.start", "--checkpoint", "mass-elastic/pod-rbf", "--port", str(port)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240.0)
    assert done.returncode == 2
    assert "choose another with --port" in done.stderr
    assert done.stderr.count("\n") == 1
