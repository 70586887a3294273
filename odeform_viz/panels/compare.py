"""The columns of the page: adding, pinning, sweeping, hiding and arranging them."""

import threading
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import viser

import odeform
from odeform.checkpoint import bundled_checkpoints
from odeform.errors import InputError
from odeform.schema import OBJECT, Schema
from odeform.simulation.contacts import contact_parameters, push_from, vector_of
from odeform_viz.columns import Column
from odeform_viz.page import Page, Panel
from odeform_viz.pushing import contacts_of
from odeform_viz.state import PageState
from odeform_viz.user_bodies import user_body_of, with_user_body
from odeform_viz.words import model_title, origin_title, parameter_title, plain, unit_text

__all__ = ["ComparePanel", "pinned_label", "sweep", "swept_names"]

SWEEP = 5  # columns of a sweep, as in the paper's figure


def pinned_label(name: str, parameters: Mapping[str, Any], schema: Schema) -> str:
    """A model's name with the parameters it is pinned at."""
    if contacts_of(schema):
        strength = float(np.linalg.norm(vector_of(parameters, "force")))
        return f"{name}: {parameters[OBJECT]}, {strength:.3g} N"
    return f"{name} at {plain({p.name: parameters[p.name] for p in schema.learned}, schema)}"


def swept_names(schema: Schema) -> tuple[str, ...]:
    """Lists what can be swept: each parameter; in scenes in which a sphere pushes, the force and the objects."""
    names = tuple(p.name for p in schema.learned)
    return ("force", OBJECT)[: 1 + (len(schema.objects) > 1)] if contacts_of(schema) else names


def sweep(column: Column, parameters: Mapping[str, Any], schema: Schema, name: str) -> list[Column]:
    """Copies of a model, pinned at even steps of a parameter over its trained range; the others stay the same.

    In scenes in which a sphere pushes, the strength of the force at the contact is swept, or each object is pushed at
    its default contact. `InputError` for what cannot be swept.
    """
    if name not in swept_names(schema):
        raise InputError(f"parameter: expected one of {', '.join(swept_names(schema))}, got {name!r}")
    predictor = column.predictor
    assert predictor is not None
    if name == OBJECT:
        rows = [(body, predictor.complete({OBJECT: body})) for body in schema.objects]
    elif contacts_of(schema):
        push, (low, high) = push_from(parameters, predictor.rest_of(parameters)), predictor.force_range(parameters)
        pushes = [replace(push, strength=float(strength)) for strength in np.linspace(low, high, SWEEP)]
        rows = [(f"{p.strength:.3g} N", {**parameters, **contact_parameters(p)}) for p in pushes]
    else:
        swept = next(p for p in schema.learned if p.name == name)
        values = [swept.denormalise(2.0 * index / (SWEEP - 1) - 1.0) for index in range(SWEEP)]
        rows = [
            (f"{parameter_title(swept)} {value:.3g} {unit_text(swept.unit)}", {**parameters, name: value})
            for value in values
        ]
    ranks = [None if name == OBJECT else index / (len(rows) - 1) for index in range(len(rows))]
    return [
        replace(column, label=label, pinned=pinned, visible=True, rank=rank)
        for (label, pinned), rank in zip(rows, ranks, strict=True)
    ]


class ComparePanel(Panel):
    """Changes the columns, and has a checkbox per column that follows changes made elsewhere."""

    def __init__(self, page: Page) -> None:
        self._page, self._gui, self._columns, self._schema = page, page.server.gui, page.columns, page.schema
        names = [name for name in bundled_checkpoints() if name.startswith(f"{self._schema.scene}/")]
        self._models = {origin_title(name): name for name in names}
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
            self._overlay = self._gui.add_checkbox("overlay", False, hint="in one place instead of side by side")
            self._overlay.on_update(lambda _: page.wake())
        page.controls.overlay = lambda: bool(self._overlay.value)
        page.controls.set_overlay = lambda value: setattr(self._overlay, "value", value)
        page.add_hotkey("O", "overlay on or off", lambda: _toggle(self._overlay))
        page.on_columns_changed(self._refresh)
        self._refresh()

    def _build_add(self) -> None:
        gui = self._gui
        if self._models:
            self._model = gui.add_dropdown("model", tuple(self._models), hint="other models of this scene")
            add = gui.add_button("Add model", color="gray")
            add.on_click(lambda _: self._guarded("Model not added", self._add))
        pin = gui.add_button("Pin these parameters", color="gray", hint="add a copy that keeps the present parameters")
        pin.on_click(lambda _: self._guarded("Parameters not pinned", self._pin))
        self._sweeps = {self._titled(name): name for name in swept_names(self._schema)}
        self._swept = gui.add_dropdown("parameter", tuple(self._sweeps))
        over = gui.add_button(
            "Sweep it",
            color="gray",
            hint=f"{SWEEP} columns over its trained range, or one for each object; other parameters stay the same",
        )
        over.on_click(lambda _: self._guarded("Sweep not added", self._sweep))

    def _titled(self, name: str) -> str:
        return next((parameter_title(p) for p in self._schema.parameters if p.name == name), name)

    def restore(self, state: PageState) -> None:
        self._overlay.value = state.display.overlay

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
        fit, body = self._page.model.fit, user_body_of(self._page.model.predictor)
        column = Column(model_title(predictor), predictor, predictor.rest, origin=self._models[self._model.value])
        if body is not None:
            column = with_user_body([column], body)[0]
        elif fit is not None:
            column = replace(column, geometry=fit.geometry, fit=fit)
        self._columns.add(column)

    def _pin(self) -> None:
        model, parameters = self._page.model, self._page.controls.parameters()
        label = pinned_label(model.label, parameters, self._schema)
        self._columns.add(replace(model, label=label, pinned=parameters, visible=True))

    def _sweep(self) -> None:
        before, name = self._columns.all, self._sweeps.get(self._swept.value, self._swept.value)
        self._columns.add(*sweep(self._page.model, self._page.controls.parameters(), self._schema, name))
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
