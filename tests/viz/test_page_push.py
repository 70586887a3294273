"""Pushing a body with the mouse."""

from collections.abc import Iterator

import numpy as np
import pytest
from browsing import Tab, needs_chromium, open_tab, until
from pushed import PushedPredictor

from odeform.simulation.contacts import vector_of
from odeform_viz.columns import Column

pytestmark = [pytest.mark.slow, needs_chromium]
BODY, BESIDE = (295, 162), (400, 200)  # px: the side of the donut, and the floor


@pytest.fixture
def tab() -> Iterator[Tab]:
    model = PushedPredictor()
    yield from open_tab(Column("stub", model, model.rest), control="tilt up (°)")


def test_a_click_moves_the_contact_and_one_beside_the_body_says_so(tab: Tab) -> None:
    before = vector_of(tab.app.request().parameters, "contact")
    tab.app.page.pause_at(0.0)
    tab.settled()
    tab.page.mouse.click(*BODY)
    assert until(lambda: not np.allclose(vector_of(tab.app.request().parameters, "contact"), before))
    contact = vector_of(tab.app.request().parameters, "contact")
    tab.page.mouse.click(*BESIDE)
    assert tab.says("That click is beside the donut")
    assert np.allclose(vector_of(tab.app.request().parameters, "contact"), contact)
