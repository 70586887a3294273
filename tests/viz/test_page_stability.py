"""The map of stability in a browser: a click on it goes there."""

from collections.abc import Iterator

import numpy as np
import pytest
from browsing import VIEW, Tab, needs_chromium, open_tab, until

from odeform.models.base import Predictor
from odeform.stress.stability import StabilityMap
from odeform_viz.columns import Column
from odeform_viz.panels.stability import StabilityPanel
from odeform_viz.rendering.framing import free_area

pytestmark = [pytest.mark.slow, needs_chromium]


@pytest.fixture
def tab(kick: Predictor) -> Iterator[Tab]:
    yield from open_tab(Column("kick", kick, kick.rest, origin="kick"))


def a_map() -> StabilityMap:
    sound, units = np.ones((2, 3, 3), dtype=bool), np.array([-3.0, 0.0, 3.0])
    boxes, moments = ("0.4 to 1.5 kg", "0.3 to 3 N m"), np.array([0.5, 1.5])
    return StabilityMap(("mass", "bending"), units, moments, 1.0, np.ones((2, 3, 3)), sound, boxes, 4e-3, 9)


def test_a_click_on_the_map_goes_there(tab: Tab) -> None:
    panel = tab.app.panel(StabilityPanel)
    tab.page.get_by_text("Stability map", exact=True).click()
    panel._done(a_map())
    image = tab.page.locator("[data-map='1']")
    image.click()  # in its middle
    mass = tab.app.session.schema.learned[0]
    assert until(lambda: tab.app.clock.time() == 1.5 and not tab.app.clock.playing)
    assert tab.app.request().parameters["mass"] == pytest.approx(mass.denormalise(0.0), rel=0.06)  # a pixel
    label = tab.page.get_by_text("place on the map")
    assert label.evaluate("node => node.closest('.odeform-unseen') !== null")
    assert not tab.errors


def test_the_map_leaves_the_body_free_and_can_be_closed(tab: Tab) -> None:
    panel = tab.app.panel(StabilityPanel)
    tab.page.get_by_text("Stability map", exact=True).click()
    panel._done(a_map())
    drawn = tab.page.locator(".odeform-map")
    drawn.wait_for()
    box, right = drawn.bounding_box(), free_area((VIEW["width"], VIEW["height"]))[2]
    assert box is not None
    assert box["x"] >= right
    tab.button("Close the map").click()
    drawn.wait_for(state="hidden")
    assert tab.button("Map stability").is_visible()
