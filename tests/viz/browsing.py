"""A page in headless Chromium with software WebGL, driven as its users drive it."""

import io
import re
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Locator, Page, sync_playwright

from odeform_figures.opened_page import CHROMIUM, FLAGS
from odeform_viz.app import App
from odeform_viz.columns import Column

__all__ = ["PATIENCE", "PHONE", "Tab", "needs_chromium", "open_tab", "until"]

VIEW = {"width": 800, "height": 480}
PATIENCE = 180.0  # s, for a busy machine
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}

needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium on the PATH (Debian: chromium)")


@dataclass
class Tab:
    """A page in the browser and what its console complained about."""

    page: Page
    app: App
    errors: list[str] = field(default_factory=list)

    def button(self, name: str) -> Locator:
        return self.page.get_by_role("button", name=name, exact=True)

    def key(self, hotkey: str) -> Locator:
        """The button of the timeline that presses a hot key."""
        return self.page.locator(f"#odeform-view [data-hotkey='{hotkey}']")

    def turn_to(self, tab: str) -> None:
        self.page.get_by_role("tab", name=tab, exact=True).click()

    def row(self, label: str, role: str) -> Locator:
        """The control in the row of that label: rows have one each."""
        row = self.page.get_by_text(label, exact=True).locator(f"xpath=ancestor::*[.//{role}][1]")
        return row.locator(f"xpath=.//{role}").first

    def slider(self, label: str) -> Locator:
        return self.row(label, "*[@role='slider']")

    def box(self, label: str) -> Locator:
        return self.row(label, "input[@type='checkbox']")

    def choose(self, label: str, option: str) -> None:
        self.row(label, "input").click()
        self.page.get_by_role("option", name=option, exact=True).click()

    def says(self, text: str, seconds: float = PATIENCE) -> bool:
        return until(lambda: self.page.get_by_text(re.compile(text)).count() > 0, seconds)

    def picture(self) -> np.ndarray:
        """(H, W, 3) pixels of the viewport left of the panel and above the plots."""
        shot = self.page.screenshot(clip={"x": 0, "y": 0, "width": 460, "height": 300}, timeout=1e3 * PATIENCE)
        return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)

    def settled(self) -> np.ndarray:
        """A picture that two screenshots in a row agree on."""
        last = self.picture()
        for _ in range(20):
            time.sleep(0.2)
            now = self.picture()
            if np.abs(now - last).max() < 8:
                return now
            last = now
        return last

    def changes(self, before: np.ndarray, seconds: float = PATIENCE) -> bool:
        """Whether the picture becomes another than before."""
        return until(lambda: (np.abs(self.picture() - before).max(axis=2) > 24).mean() > 1e-3, seconds)


def until(holds: Callable[[], bool], seconds: float = PATIENCE) -> bool:
    """Wait for what a click brings about, however busy the machine is."""
    end = time.monotonic() + seconds
    while not holds() and time.monotonic() < end:
        time.sleep(0.1)
    return holds()


def open_tab(*columns: Column, workspace: str | Path = ".", control: str = "mass (kg)", **device: Any) -> Iterator[Tab]:
    """A tab with these columns and a `control`, for a fixture to yield from. `device` are options of a browser's
    context."""
    app = App(columns, port=0, workspace=workspace)
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            tab = Tab(browser.new_page(**{"viewport": VIEW, **device}), app)
            tab.page.set_default_timeout(1e3 * PATIENCE)
            tab.page.on("console", lambda message: tab.errors.append(message.text) if message.type == "error" else None)
            tab.page.on("pageerror", lambda error: tab.errors.append(str(error)))
            tab.page.goto(app.url)
            tab.page.wait_for_selector("canvas", timeout=1e3 * PATIENCE)
            tab.page.get_by_text(control).wait_for(state="attached", timeout=1e3 * PATIENCE)
            yield tab
            browser.close()
    finally:
        app.close()
