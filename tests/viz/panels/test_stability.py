"""The map of stability, made when asked for."""

import threading

import numpy as np
import pytest

import odeform
from odeform.stress.stability import StabilityMap
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.panels.stability import StabilityPanel
from odeform_viz.panels.stability_svg import here_css, map_html
from odeform_viz.runtime.jobs import Report


def small(report: Report, checkpoint: str) -> StabilityMap:
    assert checkpoint == "kick"
    sound = np.ones((2, 3, 3), dtype=bool)
    sound[1, 2, 2] = False
    values, units = np.ones((2, 3, 3)), np.array([-3.0, 0.0, 3.0])
    boxes = ("0.4 to 1.5 kg", "0.3 to 3 N m")
    return StabilityMap(("mass", "bending"), units, np.array([0.5, 2.0]), 1.0, values, sound, boxes, 4e-3, 9)


def broken(report: Report, checkpoint: str) -> StabilityMap:
    raise RuntimeError("no such model")


@pytest.mark.parametrize(("work", "shown"), [(small, True), (broken, False)])
def test_an_image_or_why_there_is_none(kicked: tuple[App, LoopbackClient], work, shown: bool) -> None:
    app, client = kicked
    panel = app.panel(StabilityPanel)
    panel._work = work
    assert not panel._map.visible
    client.click("Map stability")
    assert client.until(lambda: panel._map.visible or "The map failed" in panel._text.content)
    assert panel._map.visible == shown
    assert panel._button.visible != shown
    assert "no such model" in panel._text.content or shown


def endless(report: Report, checkpoint: str) -> StabilityMap:
    report(0.25)
    threading.Event().wait()
    raise AssertionError


def test_a_map_shows_its_progress_and_can_be_cancelled(kicked: tuple[App, LoopbackClient]) -> None:
    app, client = kicked
    panel = app.panel(StabilityPanel)
    panel._work = endless
    client.click("Map stability")
    assert client.until(lambda: panel._bar.visible and panel._bar.value == 25.0)
    client.click("Cancel the map")
    assert client.until(lambda: panel._button.visible and not panel._bar.visible)
    assert panel._job is not None
    assert not panel._job.running
    panel._work = small
    client.click("Map stability")
    assert client.until(lambda: panel._map.visible)


def test_a_click_on_the_map_goes_there(kicked: tuple[App, LoopbackClient]) -> None:
    app, client = kicked
    panel = app.panel(StabilityPanel)
    panel._work = small
    client.click("Map stability")
    assert client.until(lambda: panel._map.visible)
    mass, bending = app.session.schema.learned[:2]
    client.set("place on the map", "0.5,0.5,0")  # the middle, at the first moment
    assert client.until(lambda: app.clock.time() == 0.5 and not app.clock.playing)
    shown = app.request().parameters
    assert shown["mass"] == pytest.approx(mass.denormalise(0.0), rel=0.01)
    assert shown["bending"] == pytest.approx(bending.denormalise(0.0), rel=0.05)
    client.set("place on the map", "nonsense")
    assert client.until(lambda: bool(client.notifications))


def test_the_map_names_its_axes_and_shows_what_is_clamped() -> None:
    schema = odeform.load("kick").schema
    drawn = map_html(small(lambda _: None, "kick"), (schema.learned[0], schema.learned[1]))
    assert all(text in drawn for text in ("mass, kg", "bending, N m", "2 s (2 × trained)"))
    assert drawn.count("data-map=") == 2


def test_the_colours_say_what_they_are_and_which_end_is_good() -> None:
    schema = odeform.load("kick").schema
    drawn = map_html(small(lambda _: None, "kick"), (schema.learned[0], schema.learned[1]))
    meant = ("change of shape, RMS", "≥ 8 mm: bad", "4 mm: the most", "in the trained range", "0 mm: good", "stopped")
    assert [text for text in meant if text not in drawn] == []


def test_a_closed_map_can_be_made_again(kicked: tuple[App, LoopbackClient]) -> None:
    app, client = kicked
    panel = app.panel(StabilityPanel)
    panel._work = small
    client.click("Map stability")
    assert client.until(lambda: panel._map.visible)
    client.click("Close the map")
    assert client.until(lambda: not panel._map.visible and panel._button.visible)
    client.click("Map stability")
    assert client.until(lambda: panel._map.visible)


@pytest.mark.parametrize(("mass", "shown"), [(0.8, True), (50.0, False)])
def test_the_map_marks_the_sliders_where_they_are_on_it(mass: float, shown: bool) -> None:
    schema = odeform.load("kick").schema
    mark = here_css(
        {"mass": mass, "bending": 0.6}, small(lambda _: None, "kick"), (schema.learned[0], schema.learned[1])
    )
    assert ("translate(" in mark) == shown
    assert ("display:none" in mark) != shown
