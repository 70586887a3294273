"""What stands beside what: columns to add, pin, sweep and hide, and how they are arranged."""

import threading
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import replace

import viser

import odeform
from odeform.errors import InputError
from odeform.schema import Parameter, Schema
from odeform_viz.columns import Column, Columns

__all__ = ["ComparePanel", "pinned_label", "sweep"]

SWEEP = 5  # columns of a sweep, as in the paper's figure


def pinned_label(name: str, parameters: Mapping[str, float], schema: Schema) -> str:
    """A model's name with the parameters it is pinned at."""
    return f"{name} at " + ", ".join(f"{p.name} {parameters[p.name]:.3g}" for p in schema.learned)


def sweep(column: Column, parameters: Mapping[str, float], schema: Schema, swept: Parameter) -> list[Column]:
    """The model of a column pinned at even steps of one parameter over its trained range, the others as they are."""
    out = []
    for index in range(SWEEP):
        at = {**parameters, swept.name: swept.denormalise(2.0 * index / (SWEEP - 1) - 1.0)}
        label = f"{swept.name} {at[swept.name]:.3g} {swept.unit}"
        out.append(replace(column, label=label, pinned=at, visible=True))
    return out


class ComparePanel:
    """Changes the columns; what it shows of them it reads back from them."""

    def __init__(
        self,
        server: viser.ViserServer,
        schema: Schema,
        columns: Columns,
        models: Mapping[str, str],
        parameters: Callable[[], dict[str, float]],
        changed: Callable[[], None],
        say: Callable[[str], None],
    ) -> None:
        """`models` are the checkpoints at hand, by name; `parameters` reads the sliders; `changed` is called after the
        columns or their arrangement have; `say` shows a message.
        """
        self._server, self._schema, self._columns = server, schema, columns
        self._models, self._parameters, self._changed, self._say = models, parameters, changed, say
        self._boxes: dict[int, viser.GuiCheckboxHandle] = {}
        self._known: dict[int, bool] = {}  # what each box was last told, or told itself
        self._refreshing = threading.Lock()
        gui = server.gui
        self._folder = gui.add_folder("Columns")
        with self._folder:
            self._clear = gui.add_button("Remove hidden columns", color="gray", visible=False)
            self._clear.on_click(lambda _: self._guarded(self._remove_hidden))
        with gui.add_folder("Add"):
            if models:
                self._model = gui.add_dropdown("model", tuple(models), hint="checkpoints of this scene")
                gui.add_button("Add model", color="gray").on_click(lambda _: self._guarded(self._add))
            pin = gui.add_button(
                "Pin these parameters", color="gray", hint="keeps a copy at the sliders' values: compare A with B"
            )
            pin.on_click(lambda _: self._guarded(self._pin))
            self._swept = gui.add_dropdown("parameter", tuple(p.name for p in schema.learned))
            over = gui.add_button(
                f"Sweep it in {SWEEP} columns", color="gray", hint="over its trained range, the others as they are"
            )
            over.on_click(lambda _: self._guarded(self._sweep))
        with gui.add_folder("Arrangement"):
            self._overlay = gui.add_checkbox("overlay", False, hint="one over the other instead of side by side")
            self._heat = gui.add_checkbox("error colours", True, hint="distance to the truth on the surface")
            for box in (self._overlay, self._heat):
                box.on_update(lambda _: changed())
        self.refresh()

    @property
    def overlay(self) -> bool:
        return bool(self._overlay.value)

    @property
    def heat(self) -> bool:
        return bool(self._heat.value)

    def set(self, overlay: bool, heat: bool) -> None:
        self._overlay.value, self._heat.value = overlay, heat

    def toggle_overlay(self) -> None:
        self._overlay.value = not self._overlay.value

    def toggle_heat(self) -> None:
        self._heat.value = not self._heat.value

    def _guarded(self, action: Callable[[], None]) -> None:
        try:
            action()
        except InputError as error:
            self._say(str(error))
        self._changed()

    def _first(self) -> Column:
        """The model that is pinned and swept: the first under the sliders."""
        return next(c for c in self._columns.all if c.predictor is not None and c.pinned is None)

    def _add(self) -> None:
        if self._model.value not in self._models:
            raise InputError(f"model: expected one of {', '.join(self._models)}, got {self._model.value!r}")
        predictor = odeform.load(self._models[self._model.value])
        like = self._first()
        shape = like.geometry if like.fit else predictor.rest
        self._columns.add(Column(predictor.model, predictor, shape, origin=self._model.value, fit=like.fit))

    def _pin(self) -> None:
        like, parameters = self._first(), self._parameters()
        label = pinned_label(like.label, parameters, self._schema)
        self._columns.add(
            Column(label, like.source, like.geometry, pinned=parameters, origin=like.origin, fit=like.fit)
        )

    def _sweep(self) -> None:
        swept = next((p for p in self._schema.learned if p.name == self._swept.value), None)
        if swept is None:
            raise InputError(f"parameter: expected one that is learned, got {self._swept.value!r}")
        before = self._columns.all
        self._columns.add(*sweep(self._first(), self._parameters(), self._schema, swept))
        for column in before:
            self._columns.set_visible(column.key, False)

    def _remove_hidden(self) -> None:
        first = self._first()
        for column in self._columns.all:
            if not column.visible and column is not first:
                self._columns.remove(column.key)

    def refresh(self) -> None:
        """One box a column; called from whatever thread changed the columns."""
        with self._refreshing:
            at_hand = {column.key: column for column in self._columns.all}
            for key in [key for key in self._boxes if key not in at_hand]:
                self._boxes.pop(key).remove()
                del self._known[key]
            with self._folder:
                for key, column in at_hand.items():
                    if key not in self._boxes:
                        box = self._server.gui.add_checkbox(column.label, column.visible, hint="show this column")
                        box.on_update(self._ticked(key))
                        self._boxes[key], self._known[key] = box, column.visible
                    elif self._known[key] != column.visible:
                        # only then: a hand may just have ticked it, and its request is yet to be read
                        self._boxes[key].value = self._known[key] = column.visible
            self._clear.visible = self._removable()

    def _removable(self) -> bool:
        return any(not c.visible for c in self._columns.all if c is not self._first())

    def _ticked(self, key: int) -> Callable[[viser.GuiEvent], Coroutine[None, None, None]]:
        async def show(event: viser.GuiEvent) -> None:
            # a coroutine reads the request at once where the message came in, before `refresh` says what is still shown
            if event.client_id is not None:
                self._known[key] = bool(event.target.value)
                self._columns.set_visible(key, self._known[key])
                self._clear.visible = self._removable()
                self._changed()

        return show
