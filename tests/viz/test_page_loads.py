"""*What happens*: the page of one model under several loads."""

import asyncio
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsing import PATIENCE, Tab, needs_chromium, open_tab, until

import odeform
from odeform.errors import InputError
from odeform.loads.hold import held_vertex
from odeform.loads.registry import get_load, known_loads
from odeform.models.base import Predictor
from odeform.schema import OBJECT
from odeform.simulation.objects.catalog import get_object
from odeform.types import Mesh
from odeform_viz.app import App
from odeform_viz.columns import Column, columns_under
from odeform_viz.page import Page
from odeform_viz.panels.load import LoadPanel
from odeform_viz.panels.parameters import ParameterPanel
from odeform_viz.panels.push import PushPanel
from odeform_viz.panels.stability import StabilityPanel
from odeform_viz.panels.summary import badge_of


@pytest.fixture(scope="module")
def pushed() -> Predictor:
    return odeform.load("contact-force")


@pytest.fixture
def column(pushed: Predictor) -> Column:
    return Column("modal", pushed, pushed.rest, origin="contact-force")


def _shows(app: App, scene: str) -> bool:
    frame = app.presenter.frame
    return frame is not None and bool(frame.columns) and frame.columns[0].motion.schema.scene == scene


def test_what_a_page_had_to_do_ends_with_it(serve: Any, column: Column) -> None:
    app, _ = serve(column)
    before, done, passed = app.page, [], threading.Event()
    app.show_load("drop")
    before.on_event_loop(lambda: done.append("before"))
    app.page.on_event_loop(lambda: done.append("now"))
    app.page.on_event_loop(passed.set)
    assert passed.wait(PATIENCE)
    assert done == ["now"]


def test_what_arrives_after_the_viewer_has_ended_is_no_error(
    serve: Any, column: Column, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, _ = serve(column)
    closed = asyncio.new_event_loop()
    closed.close()
    with monkeypatch.context() as patch:
        patch.setattr(app.server, "get_event_loop", lambda: closed)
        app.page.on_event_loop(pytest.fail)


def test_another_load_is_another_scene_with_its_own_sliders(serve: Any, column: Column) -> None:
    app, client = serve(column)
    for load, control in (
        ("drop", "height (m)"),
        ("throw", "spin y (rad/s)"),
        ("kick", "force (N)"),
        ("wall", "distance (m)"),
        ("step", "rise (m)"),
        ("slope", "angle (°)"),
        ("hold", "elevation (°)"),
        ("meet", "other's turn (°)"),
        ("push", "force (N)"),
    ):
        app.show_load(load)
        scene = "contact-force" if load == "push" else f"object-{load}"
        assert app.session.schema.scene == scene
        assert client.until(lambda scene=scene: _shows(app, scene))
        assert client.until(lambda control=control: control in client.controls)
        assert app.columns.all[0].origin == ("contact-force" if load == "push" else f"contact-force:{load}")
        assert not any(isinstance(panel, StabilityPanel) for panel in app.page.panels)


def test_sliders_of_the_body_follow_the_object(serve: Any, column: Column, pushed: Predictor) -> None:
    app, client = serve(column)
    app.show_load("drop")
    assert client.until(lambda: _shows(app, "object-drop"))
    client.set("object", "donut")
    own = pushed.complete({OBJECT: "donut"})
    assert client.until(lambda: app.request().parameters[OBJECT] == "donut")
    assert app.request().parameters["mass"] == pytest.approx(own["mass"], rel=5e-3)
    assert client.until(lambda: client.controls["mass (kg)"].value == pytest.approx(own["mass"], rel=5e-3))
    assert client.until(lambda: client.controls["preset"].value == "as it stands"), "also with three digits of a mass"
    client.set("preset", "on its side")
    assert client.until(lambda: app.request().parameters["turn_x"] == 90.0)
    assert app.request().parameters[OBJECT] == "donut", "a preset is not of one object"
    assert client.until(lambda: app.presenter.frame.columns[0].motion.parameters["turn_x"] == 90.0)


def test_a_kick_has_no_sphere_and_needs_no_room_for_one(serve: Any, column: Column) -> None:
    app, client = serve(column)
    app.show_load("kick")
    assert client.until(lambda: _shows(app, "object-kick"))
    panel, shown = app.panel(PushPanel), app.presenter.frame.columns[0]
    surface = shown.motion.geometry
    low = surface.points[surface.points[:, 2].argmin()].astype(float)
    panel.pick(shown.column, low)  # on the floor, where no sphere fits
    contact = [panel.parameters()[f"contact_{axis}"] for axis in "xyz"]
    assert np.linalg.norm(np.array(contact) - low) < 1e-3


def test_a_click_chooses_where_the_body_is_held(serve: Any, column: Column) -> None:
    app, client = serve(column)
    app.show_load("hold")
    assert client.until(lambda: _shows(app, "object-hold"))
    client.set("object", "dog")
    assert client.until(lambda: app.presenter.frame.columns[0].motion.parameters[OBJECT] == "dog")
    panel, shown = app.panel(LoadPanel), app.presenter.frame.columns[0].column
    rest = shown.predictor.rest_of({OBJECT: "dog"})
    asked = {"held_around": 35.0, "held_up": 5.0}
    place = rest.points[held_vertex(rest.points, asked)].astype(float)
    before = app.request().parameters
    panel.pick(None, place)
    assert app.request().parameters == before, "a click beside the body means nothing"
    panel.pick(shown, place)
    after = app.request().parameters
    held = rest.points[held_vertex(rest.points, after)]
    assert np.linalg.norm(held - place) < 0.06 * np.ptp(rest.points, axis=0).max()
    assert {name for name in after if after[name] != before[name]} == {"held_around", "held_up"}
    assert client.until(lambda: app.presenter.frame.columns[0].motion.parameters["held_up"] == after["held_up"])


def _refused(rest: Mesh, parameters: Mapping[str, Any]) -> bool:
    try:
        get_load("hold").situation(rest, parameters)
    except InputError:
        return True
    return False


def test_a_patch_of_nothing_is_refused_on_the_page_in_words(serve: Any, column: Column) -> None:
    app, client = serve(column)
    app.show_load("hold")
    assert client.until(lambda: _shows(app, "object-hold"))
    client.set("object", "donut")
    rest, given = get_object("donut").rest_mesh(), app.request().parameters | {"held_width": 4.7}
    around = next(float(a) for a in range(-180, 180, 5) if _refused(rest, {**given, "held_around": float(a)}))
    client.set("azimuth (°)", around)
    client.set("width (%)", 4.7)
    assert client.until(lambda: "which holds" in client.text())
    client.set("width (%)", 25.0)
    assert client.until(lambda: _shows(app, "object-hold"))
    assert app.presenter.frame.columns[0].motion.parameters["held_width"] == 25.0


@pytest.mark.parametrize("load", known_loads()[1:])
def test_nothing_is_claimed_of_a_load_that_was_not_measured(serve: Any, column: Column, load: str) -> None:
    app, client = serve(column)
    app.show_load(load)
    assert client.until(lambda: _shows(app, f"object-{load}"), 120.0)  # the first of a load may compile
    badge = badge_of(app.presenter.frame)
    assert badge.level == "outside"
    assert badge.text == "no error estimate"
    assert "no error is known for it" in badge.html
    assert not badge.expected


def test_models_of_one_scene_are_left_out(column: Column) -> None:
    other = odeform.load("mass-elastic/nearest")
    columns = [column, Column("nearest", other, other.rest)]
    assert [c.label for c in columns_under(columns, "drop")] == ["modal"]
    with pytest.raises(InputError, match="no model of the page"):
        columns_under(columns[1:], "drop")


def test_a_page_that_begins_under_a_load_gets_to_the_push() -> None:
    thrown = odeform.load("contact-force:throw")
    (column,) = columns_under([Column("modal", thrown, thrown.rest, origin="contact-force:throw")], "push")
    assert column.source.schema.scene == "contact-force"
    assert column.origin == "contact-force"


def test_a_recording_is_of_one_scene(serve: Any, column: Column, tmp_path: Path) -> None:
    app, client = serve(column)
    app.recording.start(tmp_path / "one.rrd")
    app.page.wake()
    assert client.until(lambda: app.recording.active)
    with pytest.raises(InputError, match="recording"):
        app.show_load("drop")
    assert app.session.schema.scene == "contact-force"


def test_a_page_that_cannot_be_built_leaves_the_one_before(
    serve: Any, column: Column, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, client = serve(column)
    build = ParameterPanel.__init__

    def broken(self: ParameterPanel, page: Page) -> None:
        build(self, page)
        raise RuntimeError("no such slider")

    monkeypatch.setattr(ParameterPanel, "__init__", broken)
    client.set("what happens", "Drop it")
    assert client.until(lambda: any("no such slider" in str(text) for text in client.notifications))
    assert app.session.schema.scene == "contact-force"
    assert client.until(lambda: _shows(app, "contact-force") and "force (N)" in client.controls)
    monkeypatch.undo()
    client.set("what happens", "Drop it")
    assert client.until(lambda: _shows(app, "object-drop"))


def test_pages_of_other_models_do_not_ask(serve: Any) -> None:
    kick = odeform.load("kick")
    app, _ = serve(Column("rolling", kick, kick.rest))
    assert not any(isinstance(panel, LoadPanel) for panel in app.page.panels)


@pytest.fixture
def tab(column: Column) -> Iterator[Tab]:
    yield from open_tab(column, control="what happens")


@pytest.mark.slow
@needs_chromium
def test_a_choice_in_the_browser_builds_the_page_anew(tab: Tab) -> None:
    before = tab.settled()
    tab.choose("what happens", "Throw it")
    assert tab.says("spin y")
    assert until(lambda: _shows(tab.app, "object-throw"))
    assert tab.changes(before)
    tab.choose("what happens", "Push it with a sphere")
    assert tab.says("tilt up")
    assert until(lambda: _shows(tab.app, "contact-force"))
    assert not tab.errors


@pytest.mark.slow
@needs_chromium
def test_a_busy_browser_looks_for_no_control_of_the_page_before(tab: Tab) -> None:
    for load, control in (("drop", "turn x"), ("throw", "spin y"), ("push", "tilt up")):
        tab.app.clock.play()
        # what arrives meanwhile is handled at once: frames that play, the end of two pages, and the next one
        tab.page.evaluate("() => setTimeout(() => { for (const end = Date.now() + 2500; Date.now() < end; ); })")
        tab.app.show_load("wall")
        tab.app.show_load(load)
        assert tab.says(control)
    assert tab.errors == []
