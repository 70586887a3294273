"""A figure with sliders as a file, made in a process of its own."""

import threading
from collections.abc import Callable

import viser

from odeform.errors import InputError
from odeform_viz.figure_export import figure_choices, figure_sources
from odeform_viz.page import Page
from odeform_viz.runtime.jobs import Job, make_figure

__all__ = ["FigureButton"]

NAME = "figure.html"


class FigureButton:
    """A choice of sliders, a button, and its progress."""

    def __init__(self, page: Page) -> None:
        self._page, gui, self._choices = page, page.server.gui, figure_choices(page.schema)
        self._lock = threading.Lock()
        self._sliders = gui.add_dropdown(
            "sliders", tuple(self._choices), hint="of the figure, besides that of the time"
        )
        hint = (
            "a page for others: the visible models under sliders, with their error where a truth is in view; "
            "takes up to a minute for each model"
        )
        self._button = gui.add_button("Figure (.html)", color="gray", hint=hint)
        self._button.on_click(lambda event: self._start(event.client))
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._cancel = gui.add_button("Cancel the figure", color="gray", visible=False)
        self._cancel.on_click(lambda _: self.close())
        self._work: Callable[..., bytes] = make_figure
        self._job: Job | None = None

    def close(self) -> None:
        """End the work, if there is any."""
        with self._lock:
            if self._job is not None and self._job.running:
                self._job.cancel()
                self._show(working=False)

    def _start(self, client: viser.ClientHandle | None) -> None:
        with self._lock:
            if client is None or (self._job is not None and self._job.running):
                return
            try:
                if self._sliders.value not in self._choices:
                    raise InputError(
                        f"sliders: expected one of {', '.join(self._choices)}, got {self._sliders.value!r}"
                    )
                sources = figure_sources(self._page.request(), self._choices[self._sliders.value])
            except InputError as error:
                self._failed(str(error))
                return
            times = self._page.schema.window.times
            self._show(working=True)

            def done(page: bytes) -> None:
                self._show(working=False)
                client.send_file_download(NAME, page, save_immediately=True)

            truth = next((c.truth for c in self._page.columns.all if c.visible and c.truth), None)
            self._job = Job(self._work, (sources, times, truth), done, self._failed, self._progress)
            self._job.start()

    def _show(self, working: bool) -> None:
        self._bar.value = 0.0
        self._bar.visible = self._cancel.visible = working
        self._button.visible = not working

    def _progress(self, fraction: float) -> None:
        self._bar.value = 100.0 * fraction

    def _failed(self, message: str) -> None:
        self._show(working=False)
        self._page.notices.show("Figure not made", message)
