"""The real page in a real browser: headless Chromium with software WebGL."""

import os
import re
import shutil
import socket
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, sync_playwright

from odeform.predictor import Predictor
from odeform_viz.app import App
from odeform_viz.columns import Column

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium on the PATH (Debian: chromium)")


@pytest.fixture(scope="module")
def app(kick: Predictor) -> Iterator[App]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    app = App([Column("odeform", kick, kick.rest)], port=port)
    yield app
    app.close()


@pytest.fixture(scope="module")
def page(app: App) -> Iterator[tuple[Page, list[str]]]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page(viewport={"width": 960, "height": 600})
        errors: list[str] = []
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(app.url)
        page.wait_for_selector("canvas", timeout=60_000)
        page.get_by_text("mass (kg)").wait_for(timeout=30_000)
        yield page, errors
        browser.close()


def _slider(page: Page, label: str) -> Locator:
    """The thumb in the row of that label: rows have one slider each."""
    row = page.get_by_text(label, exact=True).locator("xpath=ancestor::*[.//*[@role='slider']][1]")
    return row.get_by_role("slider").first


def _picture(page: Page) -> np.ndarray:
    """(H, W, 3) pixels of the viewport left of the panel."""
    import io

    from PIL import Image

    shot = page.screenshot(clip={"x": 0, "y": 0, "width": 620, "height": 600}, timeout=60_000)
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def _settled(page: Page) -> np.ndarray:
    """A picture that two screenshots in a row agree on."""
    last = _picture(page)
    for _ in range(20):
        time.sleep(0.3)
        now = _picture(page)
        if np.abs(now - last).max() < 8:
            return now
        last = now
    return last


def test_mass_bending_force_and_time_change_the_picture(page: tuple[Page, list[str]], app: App) -> None:
    browser, errors = page
    thumb = _slider(browser, "time (s)")
    thumb.focus()
    thumb.press("Home")
    for _ in range(36):
        thumb.press("ArrowRight")
    time.sleep(0.5)
    assert not app.clock.playing
    before = _settled(browser)
    for label, key in (("mass (kg)", "End"), ("bending (N m)", "End"), ("force (N)", "Home"), ("time (s)", "End")):
        thumb = _slider(browser, label)
        thumb.focus()
        thumb.press(key)
        after = _settled(browser)
        changed = (np.abs(after - before).max(axis=2) > 24).mean()
        assert changed > 1e-3, f"{label} changed {changed:.2%} of the picture"
        before = after
    assert app._parameters.parameters()["mass"] > 1.0
    assert app.clock.time() == pytest.approx(1.5, abs=0.01)
    assert browser.get_by_text(re.compile("extrapolated")).count() >= 1
    assert errors == []


def _until(holds: Callable[[], bool], seconds: float = 10.0) -> bool:
    """Wait for what a click brings about, however busy the machine is."""
    end = time.monotonic() + seconds
    while not holds() and time.monotonic() < end:
        time.sleep(0.1)
    return holds()


def test_play_and_largest_deformation_work_by_click(page: tuple[Page, list[str]], app: App) -> None:
    browser, errors = page
    browser.get_by_role("button", name="all", exact=True).click()
    browser.get_by_role("button", name="peak", exact=True).click()
    assert _until(lambda: 0.005 < app.clock.time() < 0.03)
    browser.get_by_role("button", name="Play", exact=True).click()
    assert _until(lambda: app.clock.playing)
    browser.get_by_role("button", name="Pause", exact=True).click()
    assert _until(lambda: not app.clock.playing)
    assert errors == []
