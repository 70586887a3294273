"""Maps where a model is stable, over two parameters and time, on request."""

import threading

import numpy as np

from odeform_viz.page import Page, Panel
from odeform_viz.pushing import contacts_of
from odeform_viz.runtime.jobs import Job, stability_image

__all__ = ["StabilityPanel"]

EXPLAINED = (
    "The deformation of the body for parameters outside the trained range (framed) and times after the trained window. "
    "Takes some seconds."
)


class StabilityPanel(Panel):
    """A button, and the map that it brings; made in a process of its own, once."""

    @classmethod
    def needed(cls, page: Page) -> bool:
        if contacts_of(page.schema) is not None:
            return False  # contacts lie on surfaces, so the trained range has no corners to map
        return bool(page.model.origin)  # the other process loads the checkpoint by its name

    def __init__(self, page: Page) -> None:
        gui = page.server.gui
        self._lock = threading.Lock()
        self._text = gui.add_markdown(EXPLAINED)
        self._button = gui.add_button("Map stability")
        self._button.on_click(lambda _: self._start())
        self._image = gui.add_image(np.full((1, 1, 3), 255, dtype=np.uint8), format="png", visible=False)
        self._job = Job(stability_image, (page.model.origin,), self._done, self._failed)

    def close(self) -> None:
        if self._job.running:
            self._job.cancel()

    def _start(self) -> None:
        with self._lock:
            if self._job.running:
                return
            self._button.disabled, self._text.content = True, "Computing several hundred motions …"
            self._job.start()

    def _done(self, image: np.ndarray) -> None:
        self._button.visible = self._text.visible = False
        self._image.image = image
        self._image.visible = True

    def _failed(self, message: str) -> None:
        self._button.disabled, self._text.content = False, f"⚠ **The map failed**: {message}"
