"""A figure with sliders in a browser: it opens from a file, moves, and asks nothing of the network."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browsing import PATIENCE, PHONE, VIEW, needs_chromium, until
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from odeform.figure import Source, Sweep, column_bytes, figure_page, interpolated
from odeform.models.base import Predictor
from odeform_figures.opened_page import CHROMIUM, FLAGS

pytestmark = [pytest.mark.slow, needs_chromium]


@pytest.fixture(scope="module")
def file(kick: Predictor, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ball beside another one that is pinned."""
    known = {parameter.name: parameter for parameter in kick.schema.parameters}
    sweeps, times = (Sweep(known["force"], 60.0, 150.0),), kick.schema.window.times[:40]
    columns = [
        interpolated(label, source, times, column_bytes(2))
        for label, source in {"odeform": Source(kick, sweeps, {}), "pinned": Source(kick, (), {})}.items()
    ]
    path = tmp_path_factory.mktemp("figure") / "figure.html"
    path.write_bytes(figure_page(columns))
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


class Opened:
    """A page, what it complained about, and what it asked for."""

    def __init__(self, page: Page, file: Path, after: str = "#paused") -> None:
        self.page, self.errors, self.requests = page, [], []
        page.set_default_timeout(1e3 * PATIENCE)
        page.on("console", lambda message: self.errors.append(message.text))
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))
        page.goto(file.as_uri() + after)
        page.wait_for_function("window.figure && window.figure.frames > 0")

    def picture(self) -> np.ndarray:
        """(H, W, 3) of the scene, once what was asked for is drawn."""
        self.page.wait_for_function("!window.figure.shown")
        shot = self.page.locator("#view").screenshot(timeout=1e3 * PATIENCE)
        return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)

    def slide(self, label: str, value: float) -> None:
        slider = self.page.get_by_role("slider", name=label, exact=True)
        slider.evaluate("(slider, value) => { slider.value = value; slider.dispatchEvent(new Event('input')); }", value)


def test_sliders_move_the_picture(browser: Browser, file: Path) -> None:
    opened = Opened(browser.new_page(viewport=VIEW), file)
    opened.slide("Time", 0.012)
    first = opened.picture()
    half = first.shape[1] // 2
    assert first[:, :half].std() > 3.0
    assert first[:, half:].std() > 3.0
    opened.slide("force", 0.0)
    weaker = opened.picture()
    assert (np.abs(weaker - first)[:, :half].max(axis=2) > 24).mean() > 1e-3
    assert np.abs(weaker - first)[:, half:].max() < 8  # that one is pinned
    assert opened.page.get_by_text("60 N").is_visible()
    opened.slide("Time", 0.2)
    assert (np.abs(opened.picture() - weaker)[:, half:].max(axis=2) > 24).mean() > 1e-3
    assert opened.errors == []
    assert [url for url in opened.requests if not url.startswith("file:")] == []
    opened.page.close()


def test_a_drag_turns_the_camera(browser: Browser, file: Path) -> None:
    opened = Opened(browser.new_page(viewport=VIEW), file)
    opened.slide("Time", 0.0)
    before = opened.picture()
    opened.page.mouse.move(200, 150)
    opened.page.mouse.down()
    opened.page.mouse.move(320, 170, steps=3)
    opened.page.mouse.up()
    assert (np.abs(opened.picture() - before).max(axis=2) > 8).mean() > 1e-3
    opened.page.close()


def test_it_plays_and_loops(browser: Browser, file: Path) -> None:
    opened = Opened(browser.new_page(viewport=VIEW), file, "")
    assert until(lambda: opened.page.evaluate("window.figure.time") > 0.01)
    opened.page.get_by_role("button", name="Pause").click()
    time = opened.page.evaluate("window.figure.time")
    assert until(lambda: not opened.page.evaluate("window.figure.shown"))
    assert opened.page.evaluate("window.figure.time") == time
    opened.page.keyboard.press("Tab")
    opened.page.keyboard.press("Space")
    assert until(lambda: opened.page.evaluate("window.figure.playing && window.figure.time") != time)
    opened.page.close()


def test_a_phone_and_a_dark_theme(browser: Browser, file: Path) -> None:
    context = browser.new_context(**PHONE, color_scheme="dark")  # pyright: ignore[reportArgumentType]
    opened = Opened(context.new_page(), file)
    picture = opened.picture()
    assert picture[-40:, :20].mean() < 60
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= 390
    assert opened.page.evaluate("document.documentElement.scrollHeight") <= 844
    assert opened.errors == []
    context.close()
