"""Maps where a model is stable, over two parameters and time, on request."""

import threading
from collections.abc import Callable

from odeform.errors import InputError
from odeform.stress.stability import StabilityMap
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.panels.stability_svg import here_css, map_html, place_of
from odeform_viz.runtime.jobs import Job, map_stability
from odeform_viz.view import Description

__all__ = ["StabilityPanel"]

EXPLAINED = (
    "How much the body changes its shape inside and outside of the trained range, within the trained time and after "
    "it. Takes about 20 s."
)
FOUND = (
    "Dark is good, pale is bad. White frame: the trained range; orange: the sliders, which a click moves there, up to "
    "their ends. From {} motions."
)


class StabilityPanel(Panel):
    """A button, its progress, and the map that it brings; made in a process of its own."""

    @classmethod
    def needed(cls, page: Page) -> bool:
        if page.schema.objects:
            return False  # each has ranges of its own, and contacts lie on surfaces: there are no corners to map
        # the other process loads the checkpoint by its name
        return bool(page.model.origin) and len(page.schema.learned) > 1

    def __init__(self, page: Page) -> None:
        gui, self._origin, self._page = page.server.gui, page.model.origin, page
        self._lock = threading.Lock()
        with gui.add_folder("Stability map", expand_by_default=False):
            self._text = gui.add_markdown(EXPLAINED)
            self._button = gui.add_button("Map stability")
            self._button.on_click(lambda _: self._start())
            self._bar = gui.add_progress_bar(0.0, visible=False)
            self._cancel = gui.add_button("Cancel the map", color="gray", visible=False)
            self._cancel.on_click(lambda _: self.close())
            self._here, self._map = gui.add_html(""), gui.add_html("", visible=False)  # the box follows the map
            # the page hides it: a click on the map writes into it
            self._place = gui.add_text("place on the map", "", visible=False)
            self._place.on_update(lambda _: self._go())
            self._closing = gui.add_button("Close the map", color="gray", visible=False)
            self._closing.on_click(lambda _: self._discard())
        self._found: StabilityMap | None = None
        self._work: Callable[..., StabilityMap] = map_stability
        self._job: Job | None = None

    def describe(self, description: Description) -> None:
        if self._found is not None:
            first, second = self._page.schema.learned[:2]
            set_content(self._here, here_css(description.frame.request.parameters, self._found, (first, second)))

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

    def _done(self, found: StabilityMap) -> None:
        self._found = found
        self._bar.visible = self._cancel.visible = False
        self._text.content = FOUND.format(found.solved)
        first, second = self._page.schema.learned[:2]
        self._place.visible = True  # before the map: clicks look for it
        self._here.content = here_css(self._page.controls.parameters(), found, (first, second))
        self._map.content = map_html(found, (first, second))
        self._map.visible = self._closing.visible = True

    def _discard(self) -> None:
        """Take the map away, so that another can be made."""
        self._found = None
        self._place.visible = self._map.visible = self._closing.visible = False
        self._show(working=False)

    def _go(self) -> None:
        if self._found is None or not self._place.value:
            return
        first, second = self._page.schema.learned[:2]
        try:
            values, time = place_of(self._place.value, self._found, (first, second))
            self._page.controls.set_parameters(values)
        except (InputError, ValueError, IndexError) as error:
            self._page.notices.show("Not gone there", str(error))
            return
        self._page.pause_at(time)

    def _failed(self, message: str) -> None:
        self._show(working=False)
        self._text.content = f"⚠ **The map failed**: {message}"
