"""The page in a browser, with the app that serves it, for pictures of it.

Needs playwright (of the development dependencies) and Chromium on the PATH, or in the environment variable CHROMIUM.
"""

from __future__ import annotations

import io
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

__all__ = ["CHROMIUM", "FLAGS", "View", "opened"]

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
DEADLINE = 300.0  # s, for a busy machine and a browser that renders in software


@dataclass(frozen=True)
class View:
    """A page in a browser, the app that serves it, and a client that sets its controls."""

    app: App
    page: Page
    client: LoopbackClient

    def tab(self, name: str) -> None:
        """Turn to a tab."""
        self.page.get_by_role("tab", name=name, exact=True).click()

    def set(self, label: str, value: object) -> None:
        """Set a control."""
        self.client.set(label, value)

    def show(self, moment: float) -> None:
        """Pause at `moment` in s, and wait for its frame."""
        self.client.set("time (s)", moment)
        self.wait(lambda: (f := self.app.presenter.frame) is not None and f.request.time == moment and not f.pending)

    def wait(self, holds: Callable[[], bool], seconds: float = DEADLINE) -> None:
        """Wait for a condition. `TimeoutError` if it does not come to hold within `seconds`."""
        if not self.client.until(holds, seconds):
            raise TimeoutError(f"the page did not get there within {seconds:g} s")

    def largest_error_time(self) -> float:
        """Finds the time, in s, of the largest error of the first column against the truth."""
        frame = self.app.presenter.frame
        assert frame is not None
        curves = self.app.session.curves(frame.columns[0], frame.request)
        assert curves.error is not None
        return round(float(curves.times[np.nanargmax(curves.error)]), 4)

    def picture(self) -> Image.Image:
        """The page once two pictures in a row agree."""
        end, last = time.monotonic() + DEADLINE, self._shot()
        while time.monotonic() < end:
            self.client.collect(0.3)
            current = self._shot()
            if np.abs(np.asarray(current, dtype=int) - np.asarray(last, dtype=int)).max() < 8:
                return current
            last = current
        raise TimeoutError(f"the page kept changing for {DEADLINE:g} s")

    def _shot(self) -> Image.Image:
        return Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")


@contextmanager
def opened(browser: Browser, columns: Sequence[Column], size: tuple[int, int], **device: Any) -> Iterator[View]:
    """A view of these columns in a browser of `size` px; `device` are options of its context."""
    workspace = tempfile.TemporaryDirectory(prefix="odeform-")
    app = App(columns, port=0, workspace=workspace.name)
    page = browser.new_page(**{"viewport": {"width": size[0], "height": size[1]}, **device})
    page.set_default_timeout(1e3 * DEADLINE)
    try:
        page.goto(app.url)
        page.wait_for_selector("canvas")
        page.get_by_text("time (s)").first.wait_for(state="attached")
        # a notification says that the browser renders in software
        page.add_style_tag(content=".mantine-Notifications-root { display: none }")
        with LoopbackClient(app.server.get_port()) as client:
            yield View(app, page, client)
    finally:
        page.close()
        app.close()
        workspace.cleanup()
