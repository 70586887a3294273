"""The viewer in a notebook: the page in a frame, its sliders moved from Python, and motions embedded as they are.

A page is served on this machine only (127.0.0.1): the browser has to run here too, or reach it through a tunnel.
"""

import html
import io
import threading
from collections.abc import Iterator, MutableMapping
from typing import Any

import numpy as np

import odeform
from odeform.models.base import Predictor
from odeform.motion.base import Motion
from odeform_viz.app import App
from odeform_viz.columns import Column
from odeform_viz.motion_files import write_html
from odeform_viz.words import model_title

__all__ = ["EmbeddedMotion", "NotebookPage", "embed", "figure", "show"]

PATIENCE = 10.0  # s that the page may take to move its sliders


def show(*models: Predictor | str, height: int = 640, port: int = 0) -> "NotebookPage":
    """Serve the page with a column for each model, and return what a notebook displays.

    Args:
        models: predictors, or names and paths as `odeform.load` takes them, of one scene.
        height: of the frame in the notebook, in pixels.
        port: to serve at; 0 takes a free one.

    Raises:
        InputError: No model, models of different scenes, or a port in use.

    Examples:
        >>> import odeform_viz
        >>> page = odeform_viz.show("mass-elastic")
        >>> page.parameters["mass"] = 0.2
        >>> round(page.parameters["mass"], 3)
        0.2
        >>> page.close()
    """
    loaded = [(str(m), odeform.load(m)) if isinstance(m, str) else ("", m) for m in models]
    if not loaded:
        raise odeform.InputError("show: expected a predictor, or the name of a checkpoint")
    columns = [Column(model_title(predictor), predictor, predictor.rest, origin=name) for name, predictor in loaded]
    return NotebookPage(App(columns, port=port), height)


class NotebookPage:
    """A served page. A notebook shows it where it is the value of a cell.

    Attributes:
        app: The viewer behind it.
        parameters: The values of the sliders by name, which move when they are set; beyond their end, they stop there.
    """

    def __init__(self, app: App, height: int) -> None:
        self.app, self.height = app, height
        self.parameters: MutableMapping[str, Any] = _Sliders(app)

    @property
    def url(self) -> str:
        """The address of the page."""
        return self.app.url

    @property
    def time(self) -> float:
        """Seconds of the motion that are shown; setting them stops playing there."""
        return self.app.clock.time()

    @time.setter
    def time(self, seconds: float) -> None:
        self.app.page.pause_at(float(seconds))

    def play(self) -> None:
        """Play the motion from where it is."""
        self.app.clock.play()
        self.app.page.wake()

    def close(self) -> None:
        """Stop serving. The frame in the notebook is empty then."""
        self.app.close()

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" width="100%" height="{self.height}" style="border:0"></iframe>'


class _Sliders(MutableMapping[str, Any]):
    """The sliders of a page as a dictionary; they are moved on the thread that handles the browser's messages."""

    def __init__(self, app: App) -> None:
        self._app = app

    def __getitem__(self, name: str) -> Any:
        return self._app.request().parameters[name]

    def __setitem__(self, name: str, value: Any) -> None:
        page = self._app.page
        page.schema.complete({name: value})  # errors are raised here, and not on the other thread
        moved = threading.Event()

        def move() -> None:
            page.controls.set_parameters(page.schema.expanded({name: value}))
            page.wake()
            moved.set()

        page.on_event_loop(move)
        moved.wait(PATIENCE)

    def __delitem__(self, name: str) -> None:
        raise TypeError("parameters of a page cannot be removed")

    def __iter__(self) -> Iterator[str]:
        return iter(self._app.request().parameters)

    def __len__(self) -> int:
        return len(self._app.request().parameters)


class EmbeddedMotion:
    """A page that needs no server, of a motion or of a figure with sliders; a notebook keeps it in its file.

    Attributes:
        html: The page, as text.
    """

    def __init__(self, page: str, height: int) -> None:
        self.html, self.height = page, height

    def _repr_html_(self) -> str:
        page = html.escape(self.html)
        return f'<iframe srcdoc="{page}" width="100%" height="{self.height}" style="border:0"></iframe>'


def embed(motion: Motion, times: Any = None, height: int = 480) -> EmbeddedMotion:
    """Make a page that plays a motion in any browser, without a server, for a notebook to keep.

    Args:
        motion: what `Predictor.solve` returned.
        times: (T,) seconds of its frames; default: those of the trained window.
        height: of the frame in the notebook, in pixels.

    Raises:
        InputError: No times.

    Examples:
        >>> import odeform, odeform_viz
        >>> player = odeform_viz.embed(odeform.load("mass-elastic").solve(), times=[0.0, 0.1, 0.2])
        >>> player.html.startswith("<!doctype html>")
        True
    """
    file = io.BytesIO()
    frames = motion.schema.window.times if times is None else times
    write_html(file, motion, np.atleast_1d(np.asarray(frames, dtype=float)), None)
    return EmbeddedMotion(file.getvalue().decode(), height)


def figure(page: bytes, height: int = 520) -> EmbeddedMotion:
    """Put a figure with sliders into a notebook, which keeps it.

    Args:
        page: what `odeform.figure.figure_page` returned, or the content of a file of `odeform predict --sweep`.
        height: of the frame in the notebook, in pixels.
    """
    return EmbeddedMotion(page.decode(), height)
