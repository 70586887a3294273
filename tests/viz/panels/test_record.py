"""What is taken away: the state of the page, the motion as a file, a recording."""

import io
import json
import threading
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
import viser

from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.figure import Source
from odeform.formats.writing import shape_at, write_shape
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.motion.recorded import RecordedMotion
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column, truth_column
from odeform_viz.panels.export import ExportPanel
from odeform_viz.panels.parameters import ParameterPanel
from odeform_viz.runtime.jobs import Report

View = tuple[App, LoopbackClient]
STATE = "odeform-mass-elastic.json"


def test_the_state_of_the_page_goes_round(serve: Callable[..., View], drop: Predictor) -> None:
    rival = load("mass-elastic/pod-rbf")
    record = truth_column(f"mass-elastic/{open_dataset('mass-elastic').select('test')[0].name}")
    app, client = serve(
        Column("odeform", drop, drop.rest, origin="mass-elastic"),
        Column("pod-rbf", rival, rival.rest, origin="mass-elastic/pod-rbf"),
        record,
        moment=0.3,
    )
    client.click("Pin these parameters")
    client.set("pod-rbf", False)
    client.set("overlay", True)
    client.set("quality", "draft")
    assert client.until(lambda: len(app.columns.all) == 4 and not app.columns.all[1].visible)
    assert client.until(lambda: app.page.options().overlay and app.request().quality == "draft")
    client.click("Save state")
    assert client.until(lambda: client.downloads.get(STATE, b"").endswith(b"}"))
    saved = client.downloads[STATE]
    labels = [(c.label, c.visible, c.pinned) for c in app.columns.all]

    client.set("reset", "all")
    client.set("overlay", False)
    client.set("quality", "balanced")
    client.set("test sequence", "none")
    client.set("time (s)", 0.9)
    assert client.until(lambda: app.clock.time() == 0.9 and len(app.columns.all) == 3)
    client.upload("Restore state", "state.json", saved)
    assert client.until(lambda: app.clock.time() == 0.3)
    assert client.until(lambda: client.controls["overlay"].value and client.controls["quality"].value == "draft")
    # the state keeps the truth behind the models
    assert sorted((c.label, c.visible, c.pinned) for c in app.columns.all) == sorted(labels)
    assert app.panel(ParameterPanel).parameters() == pytest.approx(json.loads(saved)["parameters"])
    assert client.until(lambda: "error now:" in client.text())


@pytest.mark.parametrize("content", [b"", b"\x00\xff", b"[]", b'{"odeform_state": 1}', b'{"odeform_state": 9}'])
def test_a_broken_state_changes_nothing(dropped: View, content: bytes) -> None:
    app, client = dropped
    before = app.columns.all
    client.upload("Restore state", "state.json", content)
    assert client.until(lambda: any(said.startswith("state:") for said in client.notifications))
    assert app.columns.all == before
    assert app.clock.time() == 0.3
    handles = app.server.gui._gui_input_handle_from_uuid.values()
    kept = [handle.value for handle in handles if isinstance(handle, viser.GuiUploadButtonHandle)]
    assert kept
    assert all(file.content == b"" for file in kept)


def test_the_current_frame_and_the_whole_motion_as_files(dropped: View, drop: Predictor, tmp_path: Path) -> None:
    _, client = dropped
    motion = drop.solve(drop.rest)
    client.click("Download")
    written = tmp_path / "motion.ply"
    write_shape(shape_at(motion, 0.3), written)
    assert client.until(lambda: client.downloads.get("motion_00000.ply") == written.read_bytes())
    mesh = trimesh.load(written, process=False)
    np.testing.assert_allclose(mesh.vertices, motion.vertices(0.3), atol=1e-6)  # pyright: ignore
    client.set("format", "whole motion (.npz)")
    client.click("Download")
    assert client.until(lambda: zipfile.is_zipfile(io.BytesIO(client.downloads.get("motion.npz", b""))))
    arrays = np.load(io.BytesIO(client.downloads["motion.npz"]))
    assert arrays["vertices"].shape == (len(drop.schema.window.times), len(drop.rest.points), 3)
    for suffix, start in ((".glb", b"glTF"), (".csv", b"time_s,")):
        client.set("format", f"whole motion ({suffix})")
        client.click("Download")
        assert client.until(
            lambda name=f"motion{suffix}", start=start: client.downloads.get(name, b"").startswith(start)
        )
    assert b'"animations"' in client.downloads["motion.glb"]
    assert client.downloads["motion.csv"].count(b"\n") == 1 + len(drop.schema.window.times)


def test_without_a_model_or_a_known_format_there_is_nothing_to_download(dropped: View) -> None:
    app, client = dropped
    client.set("odeform", False)
    assert client.until(lambda: not app.columns.all[0].visible)
    client.click("Download")
    assert client.until(lambda: "export: no model is visible" in client.notifications)
    client.set("format", "nonsense")
    client.click("Download")
    assert client.until(lambda: any("format: expected one of" in said for said in client.notifications))
    assert client.downloads == {}


def test_a_recording_starts_and_ends(dropped: View, tmp_path: Path) -> None:
    app, client = dropped
    path = tmp_path / "page.rrd"
    client.set("file", str(path))
    client.click("Start recording")
    assert client.until(lambda: client.controls["Stop recording"].visible)
    client.set("mass (kg)", 0.9)
    assert client.until(lambda: app.presenter.settled)
    client.click("Stop recording")
    assert client.until(lambda: client.controls["Start recording"].visible)
    assert path.stat().st_size > 0
    client.set("file", str(tmp_path / "page.rrd" / "below.rrd"))
    client.click("Start recording")
    assert client.until(lambda: "cannot be written" in client.text())
    assert client.until(lambda: client.controls["Start recording"].visible)
    assert not app.recording.active


@pytest.mark.parametrize("name", ["../page.rrd", "/etc/page.rrd", "link/page.rrd", "\0.rrd"])
def test_a_recording_stays_in_the_workspace(dropped: View, tmp_path: Path, name: str) -> None:
    app, client = dropped
    (tmp_path / "link").symlink_to("/tmp")
    client.set("file", name)
    client.click("Start recording")
    assert client.until(lambda: "which confines the page" in client.text() or "not a path" in client.text())
    assert not app.recording.active


def test_a_recording_overwrites_nothing(dropped: View, tmp_path: Path) -> None:
    app, client = dropped
    for name, why in (("notes.rrd", "the file exists"), ("notes.txt", "ending in .rrd")):
        (tmp_path / name).write_text("precious")
        client.set("file", name)
        client.click("Start recording")
        assert client.until(lambda why=why: why in client.text())
        assert (tmp_path / name).read_text() == "precious"
    assert not app.recording.active


def test_a_state_opens_no_file_outside_of_the_workspace(dropped: View, tmp_path: Path) -> None:
    app, client = dropped
    before, state = app.columns.all, json.loads(app.page.save())
    for origin in ("/etc/passwd", "../model.safetensors"):
        state["columns"][0]["origin"] = origin
        client.upload("Restore state", "state.json", json.dumps(state).encode())
        assert client.until(lambda origin=origin: any(origin in said for said in client.notifications))
    assert all("which confines the page" in said for said in client.notifications)
    assert app.columns.all == before


def tiny(report: Report, sources: list[tuple[str, Source]], times: np.ndarray, truth: RecordedMotion | None) -> bytes:
    """The names and sliders of what would be made."""
    report(0.5)
    return json.dumps([(label, [sweep.name for sweep in source.sweeps]) for label, source in sources]).encode()


def refused(
    report: Report, sources: list[tuple[str, Source]], times: np.ndarray, truth: RecordedMotion | None
) -> bytes:
    raise InputError("a figure shows a mesh with faces")


def endless(
    report: Report, sources: list[tuple[str, Source]], times: np.ndarray, truth: RecordedMotion | None
) -> bytes:
    report(0.25)
    threading.Event().wait()
    raise AssertionError


def test_a_figure_of_the_visible_models(serve: Callable[..., View], drop: Predictor) -> None:
    rival = load("mass-elastic/pod-rbf")
    pinned = Column("pinned", drop, drop.rest, pinned={"mass": 0.9, "bending": 1.0})
    app, client = serve(
        Column("odeform", drop, drop.rest), Column("pod-rbf", rival, rival.rest, visible=False), pinned, moment=0.3
    )
    button = app.panel(ExportPanel)._figure
    button._work = tiny
    client.click("Figure (.html)")
    assert client.until(lambda: "figure.html" in client.downloads)
    assert json.loads(client.downloads["figure.html"]) == [["odeform", ["mass", "bending"]], ["pinned", []]]
    button._work = refused
    client.click("Figure (.html)")
    assert client.until(lambda: "a figure shows a mesh with faces" in client.notifications)
    assert client.until(lambda: client.controls["Figure (.html)"].visible)
    button._work = endless
    client.click("Figure (.html)")
    assert client.until(lambda: button._bar.visible and button._bar.value == 25.0)
    client.click("Cancel the figure")
    assert client.until(lambda: button._button.visible and not button._bar.visible)


def test_a_figure_needs_a_model(dropped: View) -> None:
    app, client = dropped
    client.set("odeform", False)
    assert client.until(lambda: not app.columns.all[0].visible)
    client.click("Figure (.html)")
    assert client.until(lambda: "figure: expected one to 4 visible models, got 0" in client.notifications)


@pytest.mark.slow
def test_a_figure_from_the_page(dropped: View) -> None:
    _, client = dropped
    client.set("sliders", "bending")
    client.click("Figure (.html)")
    assert client.until(lambda: client.downloads.get("figure.html", b"").startswith(b"<!doctype html>"))
    assert b"Interpolated between" in client.downloads["figure.html"]
