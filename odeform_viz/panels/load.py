"""What happens to the body: a choice of the loads that the page's model computes."""

import viser

from odeform.errors import InputError
from odeform.loads.registry import PUSH, get_load, load_of_scene
from odeform_viz.page import Page, Panel

__all__ = ["LoadPanel"]

PUSHED = "Push it with a sphere"


def _titles(names: tuple[str, ...]) -> dict[str, str]:
    """The name of each load by what people read."""
    return {PUSHED if name == PUSH else get_load(name).title: name for name in names}


class LoadPanel(Panel):
    """A list of loads. Another one is another scene, with sliders of its own: the page is built anew."""

    def __init__(self, page: Page) -> None:
        self._page, predictor = page, page.model.predictor
        assert predictor is not None
        self._names = _titles(predictor.loads)
        load = load_of_scene(page.schema.scene)
        self._shown = next(title for title, name in self._names.items() if name == (load.name if load else PUSH))
        hint = "how the motion begins, and what acts on the body"
        titles = tuple(self._names)
        self._choice = page.server.gui.add_dropdown("what happens", titles, initial_value=self._shown, hint=hint)
        self._closed = False
        self._choice.on_update(self._chosen)

    @classmethod
    def needed(cls, page: Page) -> bool:
        predictor = page.model.predictor
        return predictor is not None and len(predictor.loads) > 1

    def close(self) -> None:
        self._closed = True

    def _chosen(self, event: viser.GuiEvent) -> None:
        if event.client_id is None or self._choice.value == self._shown:
            return
        title = self._choice.value
        try:
            if title not in self._names:
                raise InputError(f"what happens: expected one of {', '.join(self._names)}, got {title!r}")
            self._page.controls.show_load(self._names[title])
        except InputError as error:
            if not self._closed:  # a page that is built anew has a list of its own
                self._choice.value = self._shown
            self._page.notices.show("Nothing changed", str(error))
