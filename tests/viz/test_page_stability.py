"""The map of stability in a browser: a click on it goes there."""

from collections.abc import Iterator

import numpy as np
import pytest
from browsing import Tab, needs_chromium, open_tab, until

from odeform.models.base import Predictor
from odeform.stress.stability import StabilityMap
from odeform_viz.columns import Column
from odeform_viz.panels.stability import StabilityPanel

pytestmark = [pytest.mark.slow, needs_chromium]


@pytest.fixture
def tab(kick: Predictor) -> Iterator[Tab]:
    yield from open_tab(Column("kick", kick, kick.rest, origin="kick"))


def test_a_click_on_the_map_goes_there(tab: Tab) -> None:
    panel = tab.app.panel(StabilityPanel)
    sound, units = np.ones((2, 3, 3), dtype=bool), np.array([-3.0, 0.0, 3.0])
    boxes = ("0.4 to 1.5 kg", "0.3 to 3 N m")
    moments = np.array([0.5, 1.5])
    tab.turn_to("Stability")
    panel._done(StabilityMap(("mass", "bending"), units, moments, 1.0, np.ones((2, 3, 3)), sound, boxes, 4e-3, 9))
    image = tab.page.locator("[data-map='1']")
    image.click()  # in its middle
    mass = tab.app.session.schema.learned[0]
    assert until(lambda: tab.app.clock.time() == 1.5 and not tab.app.clock.playing)
    assert tab.app.request().parameters["mass"] == pytest.approx(mass.denormalise(0.0), rel=0.02)
    label = tab.page.get_by_text("place on the map")
    assert label.evaluate("node => node.closest('.odeform-unseen') !== null")
    assert not tab.errors
