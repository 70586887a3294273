"""The real page: keys, number boxes, the system's theme, a phone, clicks on plots."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browsing import PATIENCE, PHONE, Tab, needs_chromium, open_tab, until

from odeform.models.base import Predictor
from odeform_viz.columns import Column
from odeform_viz.panels.parameters import ParameterPanel, slider_range

pytestmark = [pytest.mark.slow, needs_chromium]

SCHEME = "document.documentElement.dataset.mantineColorScheme"


@pytest.fixture(scope="module")
def dark(kick: Predictor) -> Iterator[Tab]:
    """A page on a system with a dark theme."""
    yield from open_tab(Column("odeform", kick, kick.rest, origin="kick"), color_scheme="dark")


def _mass(tab: Tab) -> float:
    return tab.app.panel(ParameterPanel).parameters()["mass"]


def test_the_theme_follows_the_system(dark: Tab) -> None:
    assert until(lambda: dark.page.evaluate(SCHEME) == "dark")
    dark.page.emulate_media(color_scheme="light")
    assert until(lambda: dark.page.evaluate(SCHEME) == "light")
    dark.page.emulate_media(color_scheme="dark")
    assert until(lambda: dark.page.evaluate(SCHEME) == "dark")


def test_numbers_are_read_when_complete_and_refused_in_words(dark: Tab, kick: Predictor) -> None:
    box = dark.row("mass (kg)", "input[@inputmode='decimal']")

    def type_in(text: str) -> None:
        box.fill("")
        box.press_sequentially(text)
        box.press("Enter")

    low, high = slider_range(next(p for p in kick.schema.parameters if p.name == "mass"))
    type_in("0.8")
    assert until(lambda: _mass(dark) == 0.8)
    # one that is taken loses the focus, soon after: what is typed before that ends there
    assert until(lambda: not box.evaluate("box => box === document.activeElement"))
    refused = {
        "0,75": "got 0,75; write 0.75",
        "": re.escape(f"expected a number from {low:.6g} to {high:.6g}"),
        "99": "got 99",
        "abc": "got abc",
    }
    for text, said in refused.items():
        type_in(text)
        assert dark.says(said)
        assert box.input_value() == "0.8"
        assert _mass(dark) == 0.8
    type_in("7e-1")
    assert until(lambda: _mass(dark) == 0.7)
    box.fill("")
    box.press("Escape")
    assert box.input_value() == "0.7"


def test_what_is_typed_stays_while_the_page_plays(dark: Tab) -> None:
    clock = dark.app.clock
    clock.play()
    dark.app.page.wake()
    box = dark.row("time (s)", "input[@inputmode='decimal']")
    before = box.input_value()
    assert until(lambda: box.input_value() != before)
    box.fill("")
    for key in "0.25":
        shown, end = dark.app.presenter.frame, clock.time()
        box.press(key)
        assert until(lambda shown=shown, end=end: dark.app.presenter.frame is not shown and clock.time() != end)
    assert box.input_value() == "0.25"
    box.press("Enter")
    assert until(lambda: clock.time() == 0.25 and not clock.playing)
    assert until(lambda: box.input_value() == "0.25")
    assert until(lambda: dark.slider("time (s)").get_attribute("aria-valuenow") == "0.25")


def test_keys_after_a_number_are_hot_keys(dark: Tab) -> None:
    box, speed = dark.row("mass (kg)", "input[@inputmode='decimal']"), dark.app.clock.speed
    box.fill("")
    box.press_sequentially("0.75")
    box.press("Enter")
    assert until(lambda: _mass(dark) == 0.75 and dark.page.evaluate("document.activeElement === document.body"))
    dark.page.keyboard.press("s")
    assert until(lambda: dark.app.clock.speed != speed)
    assert box.input_value() == "0.75"


def test_a_number_without_a_slider_is_refused_in_words_too(dark: Tab) -> None:
    dark.choose("quality", "time budget")
    box = dark.row("at most (ms)", "input[@inputmode='decimal']")
    for text in ("5000", "0"):
        box.fill("")
        box.press_sequentially(text)
        box.press("Enter")
        assert dark.says(f"at most .ms.: expected a number from 0.1 to 1000, got {text}")
        assert box.input_value() == "5"
    dark.choose("quality", "balanced")


def test_keys_belong_to_a_focused_field_and_are_hot_keys_elsewhere(dark: Tab) -> None:
    page, clock = dark.page, dark.app.clock
    clock.pause()
    box = dark.row("mass (kg)", "input[@inputmode='decimal']")
    box.click()
    for key in ("h", "o", "Space", "ArrowRight"):
        box.press(key)
    box.press("Escape")
    dark.choose("quality", "draft")
    assert until(lambda: page.evaluate("document.activeElement === document.body"))
    page.keyboard.press("h")
    page.get_by_role("dialog").wait_for()
    assert dark.row("quality", "input").input_value() == "draft"
    assert not clock.playing
    assert not dark.app.page.options().overlay
    page.keyboard.press("h")
    page.get_by_role("dialog").wait_for(state="detached")


def test_space_plays_and_arrows_step_also_after_a_click(dark: Tab) -> None:
    page, clock = dark.page, dark.app.clock
    dark.app.page.pause_at(0.3)
    dark.key("0").click()
    assert until(lambda: clock.time() == 0.0)
    page.keyboard.press("ArrowRight")
    assert until(lambda: clock.time() == pytest.approx(1 / 120))
    page.keyboard.press("ArrowLeft")
    assert until(lambda: clock.time() == 0.0)
    page.keyboard.press("Space")
    assert until(lambda: clock.playing)
    page.keyboard.press("Space")
    assert until(lambda: not clock.playing)
    assert dark.errors == []


def test_a_button_that_the_mouse_holds_does_not_take_space(dark: Tab) -> None:
    page, clock = dark.page, dark.app.clock
    clock.pause()
    dark.key("L").hover()
    page.mouse.down()
    page.keyboard.press("ArrowRight")  # from now on the button has the keyboard's focus for the browser
    page.keyboard.press("Space")
    assert until(lambda: clock.playing)
    page.mouse.up()
    clock.pause()


def test_an_upload_is_not_called_successful_before_it_is_read(dark: Tab, tmp_path: Path) -> None:
    broken = tmp_path / "broken.ply"
    broken.write_text("ply\n")
    page = dark.page
    page.get_by_text("Shape", exact=True).first.click()
    with page.expect_file_chooser() as chooser:
        dark.button("Load a shape...").click()
    chooser.value.set_files(broken)
    assert dark.says("Shape not loaded")
    assert page.get_by_text("uploaded successfully").count() == 0


def _is_aimed(tab: Tab, size: tuple[int, int]) -> bool:
    """Whether the camera of the browser of that size has all columns in its free area."""
    cameras = [client.camera for client in tab.app.server.get_clients().values()]
    aimed = tab.app.scene._framing.camera(size)
    return any(
        (camera.image_width, camera.image_height) == size and np.allclose(camera.look_at, aimed.look_at, atol=1e-3)
        for camera in cameras
    )


def test_on_a_phone_the_panel_is_folded_until_tapped(dark: Tab) -> None:
    browser = dark.page.context.browser
    assert browser is not None
    page = browser.new_page(**PHONE)
    try:
        page.goto(dark.app.url)
        start = page.get_by_role("tab", name="Explore", exact=True)
        bar = page.get_by_text("ODeform · ball, kicked").first
        bar.wait_for(timeout=1e3 * PATIENCE)
        assert until(lambda: not start.is_visible())
        until(lambda: bar.bounding_box()["y"] > 700)  # pyright: ignore[reportOptionalSubscript]
        bar.click()
        assert until(start.is_visible)
        assert until(lambda: _is_aimed(dark, (390, 844)))
    finally:
        page.close()
