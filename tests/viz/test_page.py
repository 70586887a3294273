"""The real page: a model alone, as `odeform-viz` opens it."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from browsing import Tab, needs_chromium, open_tab, until

from odeform.models.base import Predictor
from odeform_viz.columns import Column
from odeform_viz.panels.parameters import ParameterPanel

pytestmark = [pytest.mark.slow, needs_chromium]

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
SLIDERS = "[...document.querySelectorAll('[role=slider]')].map(s => s.ariaValueNow).join()"


@pytest.fixture(scope="module")
def kicked(kick: Predictor) -> Iterator[Tab]:
    """The bundled kick, as `odeform-viz` alone shows it."""
    yield from open_tab(Column("odeform", kick, kick.rest, origin="kick"))


def test_it_moves_by_itself(kicked: Tab) -> None:
    first = kicked.page.evaluate(SLIDERS)
    kicked.page.wait_for_function(f"first => {SLIDERS} !== first", arg=first)
    assert kicked.changes(kicked.picture())
    assert kicked.errors == []


def test_mass_bending_force_and_time_change_the_image(kicked: Tab) -> None:
    thumb = kicked.slider("time (s)")
    thumb.focus()
    thumb.press("Home")
    for _ in range(36):
        thumb.press("ArrowRight")
    assert until(lambda: not kicked.app.clock.playing)
    before = kicked.settled()
    for label, key in (("mass (kg)", "End"), ("bending (N m)", "End"), ("force (N)", "Home"), ("time (s)", "End")):
        thumb = kicked.slider(label)
        thumb.focus()
        thumb.press(key)
        assert kicked.changes(before), f"{label} changed nothing"
        before = kicked.settled()
    assert kicked.app.panel(ParameterPanel).parameters()["mass"] > 1.0
    assert kicked.app.clock.time() == pytest.approx(2.0, abs=0.01)
    assert kicked.says("not reliable")  # the error that is expected there is larger than the ball
    assert kicked.says("time, mass.* beyond the trained range")
    assert kicked.errors == []


def test_presets_reset_play_and_peak_work_by_click(kicked: Tab) -> None:
    app = kicked.app
    kicked.choose("preset", "high mass, low bending")
    assert until(lambda: app.panel(ParameterPanel).parameters()["mass"] == 1.5)
    kicked.button("all").click()
    assert until(lambda: app.panel(ParameterPanel).parameters()["mass"] == 0.7)
    kicked.key("P").click()
    assert until(lambda: 0.005 < app.clock.time() < 0.03)
    kicked.key("K").click()
    assert until(lambda: app.clock.playing)
    kicked.key("K").click()
    assert until(lambda: not app.clock.playing)
    assert kicked.errors == []


def test_keys_play_step_and_help(kicked: Tab) -> None:
    page, app = kicked.page, kicked.app
    kicked.turn_to("Help")
    assert kicked.says("show models, pinned copies and the truth side by side")
    page.keyboard.press("0")
    assert until(lambda: app.clock.time() == 0.0)
    page.keyboard.press("l")
    assert until(lambda: app.clock.time() == pytest.approx(1 / 120))
    page.keyboard.press("k")
    assert until(lambda: app.clock.playing)
    page.keyboard.press("p")
    assert until(lambda: not app.clock.playing and app.clock.time() > 0.005)
    page.keyboard.press("h")
    page.get_by_role("dialog").wait_for()
    kicked.button("Close").click()
    page.get_by_role("dialog").wait_for(state="detached")
    kicked.turn_to("Explore")
    assert kicked.errors == []


def test_another_shape_is_moved_a_broken_one_refused(kicked: Tab, tmp_path: Path) -> None:
    page, before = kicked.page, kicked.settled()
    broken, good = tmp_path / "broken.ply", tmp_path / "tetrahedron.obj"
    broken.write_text("ply\n")
    good.write_text(TETRAHEDRON)
    page.get_by_role("button", name=re.compile("^Shape")).or_(page.get_by_text("Shape", exact=True)).first.click()
    for path, said in ((broken, "broken.ply"), (good, "Shape not trained")):
        with page.expect_file_chooser() as chooser:
            kicked.button("Load a shape...").click()
        chooser.value.set_files(path)
        assert kicked.says(said)
    assert kicked.changes(before)
    kicked.button("Back to the trained body").click()
    assert until(lambda: kicked.app.columns.all[0].fit is None)
    assert kicked.errors == []
