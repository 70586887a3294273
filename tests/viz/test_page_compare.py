"""The real page: a model, a rival and the truth."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browsing import Tab, needs_chromium, open_tab, until

from odeform.dataset.store import open_dataset
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform_viz.columns import Column, truth_column
from odeform_viz.panels.record import RecordPanel
from odeform_viz.panels.truth import TruthPanel

pytestmark = [pytest.mark.slow, needs_chromium]


@pytest.fixture(scope="module")
def compared(drop: Predictor, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    rival = load("mass-elastic/pod-rbf")
    yield from open_tab(
        Column("odeform", drop, drop.rest, origin="mass-elastic"),
        Column("pod-rbf", rival, rival.rest, origin="mass-elastic/pod-rbf"),
        truth_column(f"mass-elastic/{open_dataset('mass-elastic').select('test')[0].name}"),
        workspace=tmp_path_factory.mktemp("workspace"),
    )


def test_columns_are_compared_with_the_truth(compared: Tab) -> None:
    app = compared.app
    compared.key("P").click()
    compared.turn_to("Compare")
    assert compared.says("from the truth")
    assert compared.says(r"error \(dashed: expected\), mm")
    before = compared.settled()
    compared.page.keyboard.press("c")
    assert compared.changes(before)
    assert until(lambda: compared.page.get_by_text("from the truth").count() == 0)
    before = compared.settled()
    compared.box("overlay").click()
    assert compared.changes(before)
    compared.box("overlay").click()
    compared.choose("model", "nearest training motion")
    compared.button("Add model").click()
    assert compared.says("^nearest training motion$")
    compared.button("Pin these parameters").click()
    assert compared.says("odeform at mass")
    compared.button("Sweep it").click()
    assert until(lambda: sum(c.visible for c in app.columns.all) == 5)
    compared.button("Remove hidden columns").click()
    assert until(lambda: len(app.columns.all) == 6)
    assert compared.errors == []


def test_a_sequence_is_opened_left_and_found_again(compared: Tab) -> None:
    app = compared.app
    compared.turn_to("Compare")
    option = next(iter(app.panel(TruthPanel)._entries))
    compared.choose("test sequence", option)
    assert until(lambda: any(c.truth for c in app.columns.all))
    compared.box("odeform").click()
    assert compared.says("error now:")
    compared.turn_to("Explore")
    thumb = compared.slider("mass (kg)")
    thumb.focus()
    thumb.press("Home")
    assert compared.says("The truth was simulated with other parameters")
    compared.turn_to("Compare")
    compared.button("Set sliders to the truth").click()
    assert compared.says("error now:")
    assert compared.errors == []


def test_a_state_a_file_and_a_recording_are_taken_away(compared: Tab, tmp_path: Path) -> None:
    page, app = compared.page, compared.app
    compared.key("P").click()
    assert until(lambda: app.clock.time() > 0.1 and not app.clock.playing)
    # new sliders may aim the cameras anew: with a frame, and only then
    assert until(lambda: app.presenter.settled)
    compared.turn_to("Record")
    with page.expect_download() as saved:
        compared.button("Save state").click()
    state = tmp_path / "state.json"
    saved.value.save_as(state)
    moment, (client,) = app.clock.time(), app.server.get_clients().values()
    looked = np.array(client.camera.position)
    client.camera.position = looked + np.array([0.0, 0.0, 0.3])
    compared.key("0").click()
    assert until(lambda: app.clock.time() != moment and client.camera.position[2] > looked[2] + 0.2)
    with page.expect_file_chooser() as chooser:
        compared.button("Restore state").click()
    chooser.value.set_files(state)
    assert until(lambda: app.clock.time() == moment)
    assert until(lambda: np.allclose(client.camera.position, looked, atol=1e-3))
    with page.expect_download() as mesh:
        compared.button("Download").click()
    assert mesh.value.suggested_filename == "motion_00000.ply"
    field = compared.row("file", "input")
    field.fill("page.rrd")
    field.press("Enter")
    path = app.panel(RecordPanel)._path
    assert until(lambda: path.value == "page.rrd")
    compared.button("Start recording").click()
    assert compared.says(r"page\.rrd, \d+ frames")
    compared.button("Stop recording").click()
    compared.button("Start recording").wait_for()
    assert (app.page.workspace.root / "page.rrd").stat().st_size > 0
    assert compared.errors == []
