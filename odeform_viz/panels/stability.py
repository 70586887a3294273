"""Maps where a model is stable, over two parameters and time, on request."""

import threading
from collections.abc import Callable

import numpy as np

from odeform_viz.page import Page, Panel
from odeform_viz.runtime.jobs import MAPPED, Job, stability_image

__all__ = ["StabilityPanel"]

EXPLAINED = (
    "The deformation of the body for parameters outside the trained range (framed) and times after the trained window, "
    f"from {MAPPED * MAPPED} motions of three times that window."
)


class StabilityPanel(Panel):
    """A button, its progress, and the map that it brings; made in a process of its own."""

    @classmethod
    def needed(cls, page: Page) -> bool:
        if page.schema.objects:
            return False  # each has ranges of its own, and contacts lie on surfaces: there are no corners to map
        return bool(page.model.origin)  # the other process loads the checkpoint by its name

    def __init__(self, page: Page) -> None:
        gui, self._origin = page.server.gui, page.model.origin
        self._lock = threading.Lock()
        self._text = gui.add_markdown(EXPLAINED)
        self._button = gui.add_button("Map stability")
        self._button.on_click(lambda _: self._start())
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._cancel = gui.add_button("Cancel the map", color="gray", visible=False)
        self._cancel.on_click(lambda _: self.close())
        self._image = gui.add_image(np.full((1, 1, 3), 255, dtype=np.uint8), format="png", visible=False)
        self._work: Callable[..., np.ndarray] = stability_image
        self._job: Job | None = None

    def close(self) -> None:
        with self._lock:
            if self._job is not None and self._job.running:
                self._job.cancel()
                self._show(working=False)

    def _start(self) -> None:
        with self._lock:
            if self._job is not None and self._job.running:
                return
            self._show(working=True)
            self._job = Job(self._work, (self._origin,), self._done, self._failed, self._progress)
            self._job.start()

    def _show(self, working: bool) -> None:
        self._text.content, self._bar.value = EXPLAINED, 0.0
        self._bar.visible = self._cancel.visible = working
        self._button.visible = not working

    def _progress(self, fraction: float) -> None:
        self._bar.value = 100.0 * fraction

    def _done(self, image: np.ndarray) -> None:
        self._bar.visible = self._cancel.visible = self._text.visible = False
        self._image.image = image
        self._image.visible = True

    def _failed(self, message: str) -> None:
        self._show(working=False)
        self._text.content = f"⚠ **The map failed**: {message}"
