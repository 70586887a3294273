"""The real page: clicks on plots."""

from collections.abc import Iterator

import pytest
from browsing import Tab, needs_chromium, open_tab, until

from odeform.models.base import Predictor
from odeform_viz.columns import Column

pytestmark = [pytest.mark.slow, needs_chromium]


@pytest.fixture(scope="module")
def tab(kick: Predictor) -> Iterator[Tab]:
    yield from open_tab(Column("odeform", kick, kick.rest, origin="kick"))


def test_a_click_on_a_curve_goes_to_that_time(tab: Tab) -> None:
    tab.app.page.pause_at(0.1)
    box = tab.row("time (s)", "input[@inputmode='decimal']")
    assert until(lambda: box.input_value() == "0.1")
    plot = tab.page.locator("svg[data-time-slider]").first
    plot.wait_for()
    where = plot.bounding_box()
    assert where is not None
    # the middle of the area that is drawn on: 34 to 202 of 208; a click of the locator waits until the plot stays still
    plot.click(position={"x": where["width"] * 118 / 208, "y": 0.5 * where["height"]})
    assert until(lambda: tab.app.clock.time() == pytest.approx(1.0, abs=0.02))


def test_a_selected_number_stays_selected_while_the_time_plays(tab: Tab) -> None:
    tab.app.clock.play()
    tab.app.page.wake()
    box = tab.row("time (s)", "input[@inputmode='decimal']")
    box.select_text()
    before = box.input_value()
    assert until(lambda: box.input_value() != before)
    assert box.evaluate("box => box.selectionEnd - box.selectionStart === box.value.length")
    box.press_sequentially("0.25")
    assert box.input_value() == "0.25"


@pytest.mark.parametrize("confirm", [True, False])
def test_a_click_on_a_curve_replaces_a_time_that_was_typed(tab: Tab, confirm: bool) -> None:
    clock = tab.app.clock
    clock.play()
    tab.app.page.wake()
    box = tab.row("time (s)", "input[@inputmode='decimal']")
    box.fill("")
    box.press_sequentially("0.25")
    if confirm:
        box.press("Enter")
        assert until(lambda: clock.time() == 0.25 and not clock.playing)
    plot = tab.page.locator("svg[data-time-slider]").first
    where = plot.bounding_box()
    assert where is not None
    plot.click(position={"x": where["width"] * 118 / 208, "y": 0.5 * where["height"]})
    assert until(lambda: clock.time() == pytest.approx(1.0, abs=0.02))
