"""The real page: what lies over the scene, and the colours of values."""

import io
from collections.abc import Iterator

import numpy as np
import pytest
import viser
from browsing import PHONE, Tab, needs_chromium, open_tab, until
from PIL import Image
from rendering.test_framing import project

from odeform.models.base import Predictor
from odeform_viz.coloring.scale import TABLE
from odeform_viz.columns import Column

pytestmark = [pytest.mark.slow, needs_chromium]

IN_VIEW = {"caption": "ball, kicked", "trust": "inside the trained range", "timeline": "trained until 1 s"}
MOMENT = "getComputedStyle(document.querySelector('#odeform-view .odeform-moment'), '::after').content"


@pytest.fixture(scope="module")
def tab(kick: Predictor) -> Iterator[Tab]:
    yield from open_tab(Column("odeform", kick, kick.rest, origin="kick"))


def test_caption_badge_and_timeline_are_in_view_whatever_the_tab(tab: Tab) -> None:
    for name in ("Compare", "Explore"):
        tab.turn_to(name)
        for place, text in (
            ("caption", "kick"),
            ("trust", "inside the trained range"),
            ("timeline", "speed"),
        ):
            shown = tab.page.locator(f"#odeform-view > [data-odeform-view={place}]")
            assert until(lambda shown=shown, text=text: text in shown.inner_text())
            box = shown.bounding_box()
            assert box is not None
            assert box["x"] >= 0
            assert box["x"] + box["width"] <= 800
            assert box["y"] >= 0
            assert box["y"] + box["height"] <= 480
    assert tab.errors == []


def test_no_panel_covers_another_also_in_a_small_page(tab: Tab) -> None:
    panels = tab.page.locator("[data-floating-window]")
    assert until(lambda: panels.count() == 2)

    def apart() -> bool:
        one, other = (panels.nth(index).bounding_box() for index in range(2))
        assert one is not None
        assert other is not None
        return one["x"] + one["width"] <= other["x"] or other["x"] + other["width"] <= one["x"]

    assert until(apart)


def test_a_drag_along_the_timeline_scrubs_also_beside_it(tab: Tab) -> None:
    track = tab.page.locator("#odeform-view .odeform-track")
    box = track.bounding_box()
    assert box is not None
    tab.page.mouse.move(box["x"] + 0.1 * box["width"], box["y"] + 10)
    tab.page.mouse.down()
    assert until(lambda: tab.app.clock.time() == pytest.approx(0.2, abs=0.02) and not tab.app.clock.playing)
    tab.page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] - 100, steps=5)
    tab.page.mouse.up()
    assert until(lambda: tab.app.clock.time() == pytest.approx(1.0, abs=0.02))
    assert until(lambda: "1.0" in tab.page.evaluate(MOMENT))


def test_buttons_of_the_timeline_play_and_change_the_speed(tab: Tab) -> None:
    tab.app.page.pause_at(0.1)
    tab.key("K").click()
    assert until(lambda: tab.app.clock.playing)
    tab.key("K").click()
    assert until(lambda: not tab.app.clock.playing)
    before = tab.key("S").inner_text()
    tab.key("S").click()
    assert until(lambda: tab.key("S").inner_text() != before)
    tab.key("R").click()
    assert until(lambda: not tab.app.clock.loop and tab.key("R").inner_text() == "once")


def test_a_value_has_exactly_the_colour_of_the_scale(tab: Tab) -> None:
    tab.app.page.pause_at(0.0)  # nothing is displaced: the lowest colour everywhere
    tab.turn_to("View")
    tab.choose("colour by", "displacement")
    assert until(lambda: tab.app.presenter.scale is not None and tab.app.presenter.settled)
    size = (1200, 800)  # at which nothing lies over the body
    tab.page.set_viewport_size({"width": size[0], "height": size[1]})
    assert until(lambda: max(c.camera.image_width / c.camera.image_height for c in _clients(tab)) == pytest.approx(1.5))
    centre = np.asarray(tab.app.columns.all[0].geometry.points, dtype=float).mean(axis=0)
    x, y = project(centre[None], tab.app.scene._framing.camera(size), size)[0].round().astype(int)

    def pixel() -> np.ndarray:
        shot = tab.page.screenshot(clip={"x": int(x), "y": int(y), "width": 4, "height": 4})
        return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)[0, 0]

    assert until(lambda: np.abs(pixel() - TABLE[0]).max() <= 3), pixel()


def _clients(tab: Tab) -> list[viser.ClientHandle]:
    return list(tab.app.server.get_clients().values())


def test_on_a_phone_the_body_fills_the_width(tab: Tab) -> None:
    browser = tab.page.context.browser
    assert browser is not None
    page = browser.new_page(**PHONE)
    try:
        page.goto(tab.app.url)
        page.wait_for_selector("canvas")
        assert until(lambda: page.locator("#odeform-view .odeform-track").count() == 1)
        points = np.asarray(tab.app.columns.all[0].geometry.points, dtype=float)
        pixels = project(points, tab.app.scene._framing.camera((390, 844)), (390, 844))
        assert np.ptp(pixels[:, 0]) > 0.6 * 390
    finally:
        page.close()


def test_a_fine_screen_is_laid_out_as_a_coarse_one(tab: Tab) -> None:
    browser = tab.page.context.browser
    assert browser is not None
    page = browser.new_page(viewport={"width": 700, "height": 400}, device_scale_factor=3)
    try:
        page.goto(tab.app.url)
        page.wait_for_selector("canvas")
        assert until(lambda: (700, 400) in [(c.camera.image_width, c.camera.image_height) for c in _clients(tab)])
    finally:
        page.close()
