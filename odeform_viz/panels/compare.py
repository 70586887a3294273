"""The columns of the page: adding, pinning, sweeping, hiding and arranging them."""

import threading
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import replace

import viser

import odeform
from odeform.checkpoint import bundled_checkpoints
from odeform.errors import InputError
from odeform.schema import Parameter, Schema
from odeform_viz.columns import Column
from odeform_viz.page import Page, Panel
from odeform_viz.state import PageState

__all__ = ["ComparePanel", "pinned_label", "sweep"]

SWEEP = 5  # columns of a sweep, as in the paper's figure


def pinned_label(name: str, parameters: Mapping[str, float], schema: Schema) -> str:
    """A model's name with the parameters it is pinned at."""
    return f"{name} at " + ", ".join(f"{p.name} {parameters[p.name]:.3g}" for p in schema.learned)


def sweep(column: Column, parameters: Mapping[str, float], schema: Schema, swept: Parameter) -> list[Column]:
    """Copies of a model, pinned at even steps of one parameter over its trained range; the others stay the same."""
    out = []
    for index in range(SWEEP):
        pinned = {**parameters, swept.name: swept.denormalise(2.0 * index / (SWEEP - 1) - 1.0)}
        label = f"{swept.name} {pinned[swept.name]:.3g} {swept.unit}"
        out.append(replace(column, label=label, pinned=pinned, visible=True))
    return out


class ComparePanel(Panel):
    """Changes the columns, and has a checkbox per column that follows changes made elsewhere."""

    def __init__(self, page: Page) -> None:
        self._page, self._gui, self._columns, self._schema = page, page.server.gui, page.columns, page.schema
        self._models = {n: str(p) for n, p in bundled_checkpoints().items() if n.startswith(f"{self._schema.scene}/")}
        self._boxes: dict[int, viser.GuiCheckboxHandle] = {}
        self._sent: dict[int, bool] = {}  # the value that each box was last set to, by the viewer or by the user
        self._refreshing = threading.Lock()
        self._folder = self._gui.add_folder("Columns")
        with self._folder:
            self._clear = self._gui.add_button("Remove hidden columns", color="gray", visible=False)
            self._clear.on_click(lambda _: self._guarded("Columns not removed", self._remove_hidden))
        with self._gui.add_folder("Add"):
            self._build_add()
        with self._gui.add_folder("Arrangement"):
            self._overlay = self._gui.add_checkbox("overlay", False, hint="draw columns over each other, not in a row")
            self._error_colors = self._gui.add_checkbox(
                "error colours", True, hint="colour the surface by its distance to the truth"
            )
            for box in (self._overlay, self._error_colors):
                box.on_update(lambda _: page.wake())
        page.controls.overlay = lambda: bool(self._overlay.value)
        page.controls.error_colors = lambda: bool(self._error_colors.value)
        page.add_hotkey("O", "overlay on or off", lambda: _toggle(self._overlay))
        page.add_hotkey("C", "error colours on or off", lambda: _toggle(self._error_colors))
        page.on_columns_changed(self._refresh)
        self._refresh()

    def _build_add(self) -> None:
        gui = self._gui
        if self._models:
            self._model = gui.add_dropdown("model", tuple(self._models), hint="bundled checkpoints of this scene")
            add = gui.add_button("Add model", color="gray")
            add.on_click(lambda _: self._guarded("Model not added", self._add))
        pin = gui.add_button("Pin these parameters", color="gray", hint="add a copy that keeps the present parameters")
        pin.on_click(lambda _: self._guarded("Parameters not pinned", self._pin))
        self._swept = gui.add_dropdown("parameter", tuple(p.name for p in self._schema.learned))
        over = gui.add_button(
            f"Sweep it in {SWEEP} columns", color="gray", hint="over its trained range; the others stay the same"
        )
        over.on_click(lambda _: self._guarded("Sweep not added", self._sweep))

    def restore(self, state: PageState) -> None:
        self._overlay.value, self._error_colors.value = state.display.overlay, state.display.error_colors

    def _guarded(self, title: str, action: Callable[[], None]) -> None:
        """Change the columns, or show under `title` why not."""
        try:
            action()
        except InputError as error:
            self._page.notices.show(title, str(error))
        self._page.columns_changed()

    def _add(self) -> None:
        if self._model.value not in self._models:
            raise InputError(f"model: expected one of {', '.join(self._models)}, got {self._model.value!r}")
        predictor = odeform.load(self._models[self._model.value])
        fit = self._page.model.fit
        shape = fit.geometry if fit else predictor.rest
        self._columns.add(Column(predictor.model, predictor, shape, origin=self._model.value, fit=fit))

    def _pin(self) -> None:
        model, parameters = self._page.model, self._page.controls.parameters()
        label = pinned_label(model.label, parameters, self._schema)
        self._columns.add(replace(model, label=label, pinned=parameters, visible=True))

    def _sweep(self) -> None:
        swept = next((p for p in self._schema.learned if p.name == self._swept.value), None)
        if swept is None:
            names = ", ".join(p.name for p in self._schema.learned)
            raise InputError(f"parameter: expected one of {names}, got {self._swept.value!r}")
        before = self._columns.all
        self._columns.add(*sweep(self._page.model, self._page.controls.parameters(), self._schema, swept))
        for column in before:
            self._columns.set_visible(column.key, False)

    def _remove_hidden(self) -> None:
        first = self._page.model
        for column in self._columns.all:
            if not column.visible and column is not first:
                self._columns.remove(column.key)

    def _refresh(self) -> None:
        """Add and remove checkboxes, and let them follow the columns."""
        with self._refreshing:
            current = {column.key: column for column in self._columns.all}
            for key in [key for key in self._boxes if key not in current]:
                self._boxes.pop(key).remove()
                del self._sent[key]
            with self._folder:
                for key, column in current.items():
                    if key not in self._boxes:
                        box = self._gui.add_checkbox(column.label, column.visible, hint="show or hide this column")
                        box.on_update(self._ticked(key))
                        self._boxes[key], self._sent[key] = box, column.visible
                    elif self._sent[key] != column.visible:
                        # not always: the user may just have ticked it, which `_ticked` has yet to read
                        self._boxes[key].value = self._sent[key] = column.visible
            self._clear.visible = self._has_hidden()

    def _has_hidden(self) -> bool:
        return any(not c.visible for c in self._columns.all if c is not self._page.model)

    def _ticked(self, key: int) -> Callable[[viser.GuiEvent], Coroutine[None, None, None]]:
        async def apply(event: viser.GuiEvent) -> None:
            # a coroutine runs at once where the message arrives, before `_refresh` shows the old value again
            if event.client_id is not None:
                self._sent[key] = bool(event.target.value)
                self._columns.set_visible(key, self._sent[key])
                self._clear.visible = self._has_hidden()
                self._page.columns_changed()

        return apply


def _toggle(box: viser.GuiCheckboxHandle) -> None:
    box.value = not box.value
