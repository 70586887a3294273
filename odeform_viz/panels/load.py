"""What happens to the body: a choice of the loads that the page's model computes."""

import viser

from odeform.errors import InputError
from odeform.loads.registry import PUSH, get_load, load_of_scene
from odeform.types import Vector
from odeform_viz.columns import Column
from odeform_viz.page import Page, Panel
from odeform_viz.pushing import surface_of

__all__ = ["LoadPanel"]

PUSHED = "Push it with a sphere"


def _titles(names: tuple[str, ...]) -> dict[str, str]:
    """The name of each load by what people read."""
    return {PUSHED if name == PUSH else get_load(name).title: name for name in names}


class LoadPanel(Panel):
    """A list of loads. Another one is another scene, with sliders of its own: the page is built anew. Under some, a
    click on the body sets sliders."""

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
        self._load = load
        if load is not None and load.pick is not None:
            page.server.gui.add_markdown(f"Click the body to choose {load.picks}.")
            page.controls.pick = self.pick

    @classmethod
    def needed(cls, page: Page) -> bool:
        predictor = page.model.predictor
        return predictor is not None and len(predictor.loads) > 1

    def pick(self, column: Column | None, point: Vector) -> None:
        """Set the parameters of the load that belong to a point (3,) m of the shape at rest, and show the motion from
        its start.

        Without a column nothing happens: a click on the floor is meant for nothing.
        """
        assert self._load is not None
        assert self._load.pick is not None
        if column is None:
            return
        try:
            if column.predictor is None:
                raise InputError("This motion is finished: click the body of a model.")
            if column.pinned is not None:
                raise InputError(f"{column.label} is pinned: click a column that follows the sliders.")
            rest = surface_of(column, self._page.controls.parameters())
            self._page.controls.set_parameters(self._load.pick(rest, point))
        except InputError as error:
            self._page.notices.show("Nothing changed", str(error))
            return
        if self._page.clock.playing:
            self._page.clock.seek(self._page.schema.window.start)

    def close(self) -> None:
        self._closed = True

    def _chosen(self, event: viser.GuiEvent) -> None:
        if event.client_id is None or self._choice.value == self._shown:
            return
        title = self._choice.value
        try:
            if title not in self._names:
                raise InputError(f"what happens: expected one of {', '.join(self._names)}, got {title!r}")
            self._page.controls.show_load(self._names[title], {})
        except InputError as error:
            if not self._closed:  # a page that is built anew has a list of its own
                self._choice.value = self._shown
            self._page.notices.show("Nothing changed", str(error))
