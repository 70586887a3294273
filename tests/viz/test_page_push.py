"""Pushing a body with the mouse."""

from collections.abc import Iterator

import numpy as np
import pytest
from browsing import Tab, needs_chromium, open_tab, until
from pushed import PushedPredictor

from odeform.simulation.contacts import vector_of
from odeform_viz.columns import Column

pytestmark = [pytest.mark.slow, needs_chromium]
BODY, ELSEWHERE, BESIDE = (285, 174), (215, 176), (400, 212)  # px: two places on the side of the donut, and the floor


@pytest.fixture
def tab() -> Iterator[Tab]:
    model = PushedPredictor()
    yield from open_tab(Column("stub", model, model.rest), control="tilt up (°)")


def test_a_click_moves_the_contact_and_one_beside_the_body_does_nothing(tab: Tab) -> None:
    def contact() -> np.ndarray:
        return vector_of(tab.app.request().parameters, "contact")

    before = contact()
    tab.app.page.pause_at(0.0)
    tab.settled()
    tab.page.mouse.click(*BODY)
    assert until(lambda: not np.allclose(contact(), before))
    tab.settled()
    clicked = contact()
    tab.page.mouse.click(*BESIDE)
    tab.settled()
    assert np.allclose(contact(), clicked)
    tab.page.mouse.click(*ELSEWHERE)
    assert until(lambda: not np.allclose(contact(), clicked))
