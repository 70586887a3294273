"""What is taken away: the state of the page, the motion as a file, a recording."""

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from odeform.dataset.store import open_dataset
from odeform.formats.writing import shape_at, write_shape
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform_viz.app import App
from odeform_viz.benchmark.client import LoopbackClient
from odeform_viz.columns import Column, truth_column
from odeform_viz.panels.parameters import ParameterPanel

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
    assert client.controls["Start recording"].visible
    assert not app.recording.active
