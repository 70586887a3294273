"""Where a model is stable: a picture over two parameters and time, made when asked for."""

import threading

import numpy as np
import viser

from odeform_viz.runtime.jobs import Job, stability_image

__all__ = ["StabilityPanel"]

EXPLAINED = (
    "How far the body is deformed as two parameters leave what was trained (framed), and later than was trained. "
    "It takes some seconds."
)


class StabilityPanel:
    """A button, and the picture that it brings; made in a process of its own, once for a model."""

    def __init__(self, server: viser.ViserServer, origin: str) -> None:
        """`origin` names the checkpoint."""
        self._lock = threading.Lock()
        self._text = server.gui.add_markdown(EXPLAINED)
        self._button = server.gui.add_button("Map stability")
        self._button.on_click(lambda _: self._start())
        self._picture = server.gui.add_image(np.full((1, 1, 3), 255, dtype=np.uint8), format="png", visible=False)
        self._job = Job(stability_image, (origin,), self._done, self._failed)

    def _start(self) -> None:
        with self._lock:
            if self._job.running:
                return
            self._button.disabled, self._text.content = True, "Solving some hundred motions …"
            self._job.start()

    def _done(self, picture: np.ndarray) -> None:
        self._button.visible = self._text.visible = False
        self._picture.image = picture
        self._picture.visible = True

    def _failed(self, message: str) -> None:
        self._button.disabled, self._text.content = False, f"⚠ **No map**: {message}"

    def close(self) -> None:
        if self._job.running:
            self._job.cancel()
