"""The sliders of the scene's parameters, with presets and marks where the model was trained."""

import math
import threading
from collections.abc import Mapping
from typing import Any

import numpy as np
import viser

from odeform.errors import InputError
from odeform.loads.registry import load_of_scene
from odeform.schema import OBJECT, Parameter, Schema
from odeform.types import Floats
from odeform_viz.columns import Column
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.panels.object_choice import ObjectChoice
from odeform_viz.pushing import contacts_of
from odeform_viz.state import PageState
from odeform_viz.view import Description
from odeform_viz.words import description_of, known_range, parameter_title, unit_text

__all__ = ["ParameterPanel", "presets", "slider_range"]

NO_PRESET = "own values"
MARGIN = 0.2  # of the trained span, by which a slider reaches beyond it
BINS = 160  # along a slider; training samples in one bin share a mark


def slider_range(parameter: Parameter) -> tuple[float, float]:
    """Low and high end of a slider: a margin beyond the trained range, which does not cross zero.

    The angle of a symmetry has no margin.
    """
    if parameter.role == "azimuth":
        return parameter.low, parameter.high
    margin = MARGIN * (parameter.high - parameter.low)
    low = parameter.low - margin
    if parameter.low >= 0.0:
        low = max(low, 0.5 * parameter.low)
    return low, parameter.high + margin


def slider_step(low: float, high: float) -> float:
    """The largest power of ten that divides the slider into at least 200 steps."""
    return 10.0 ** math.floor(math.log10((high - low) / 200.0))


def presets(schema: Schema) -> dict[str, dict[str, float]]:
    """Returns what a load has; in other scenes the defaults, and the corners of the trained range of the first two
    learned parameters."""
    defaults = {p.name: p.default for p in schema.parameters}
    if (load := load_of_scene(schema.scene)) is not None:
        return {name: {**defaults, **values} for name, values in load.presets.items()}
    out = {"defaults": defaults}
    first, second = schema.learned[0], schema.learned[min(1, len(schema.learned) - 1)]
    for one in ("low", "high"):
        for two in ("low", "high"):
            if first is not second:
                name = f"{one} {first.name}, {two} {second.name}"
                out[name] = {**defaults, first.name: getattr(first, one), second.name: getattr(second, two)}
    return out


def samples_svg(parameter: Parameter, samples: Floats | None, value: float, known: str = "trained range") -> str:
    """HTML below a slider: the range that is `known`, a mark per training sample, and a warning if `value` is outside.

    The warning stands under the name of the slider: a line of its own would shove the others while one drags.
    """
    low, high = slider_range(parameter)

    def percent(x: float) -> float:
        return 100.0 * (x - low) / (high - low)

    left, right = percent(parameter.low), percent(parameter.high)
    band = f'<rect x="{left:.1f}%" width="{right - left:.1f}%" y="0" height="5" fill="#dfe6ee"/>'
    marks = warning = ""
    if samples is not None:
        bins = np.unique(np.round((samples - low) / (high - low) * BINS).astype(int))
        marks = "".join(f'<rect x="{100.0 * b / BINS:.2f}%" width="1" y="0" height="5" fill="#4a6a8c"/>' for b in bins)
    if not parameter.inside(value):
        end = parameter.high if value > parameter.high else parameter.low
        far = f"outside the {known}, {parameter.low:.3g} to {parameter.high:.3g} {unit_text(parameter.unit)}"
        warning = f'<b title="{far}" aria-label="{far}">⚠ {known.replace("range", "to")} {end:.3g}</b>'
    return (
        f'<div class="odeform-range"><svg width="100%" height="5" style="display:block">{band}{marks}</svg>'
        f"{warning}</div>"
    )


def _training_samples(column: Column) -> Mapping[str, Floats]:
    """The values (S,) of each learned parameter in the training split; empty for checkpoints without them."""
    if column.predictor is None or "training.theta" not in column.predictor.checkpoint.arrays:
        return {}
    theta = column.predictor.checkpoint.arrays["training.theta"]
    learned = column.predictor.schema.learned
    return {p.name: np.array([p.denormalise(float(x)) for x in theta[:, i]]) for i, p in enumerate(learned)}


class ParameterPanel(Panel):
    """A slider per parameter with its unit, its trained range and the training samples in it."""

    def __init__(self, page: Page) -> None:
        self._page, self._schema = page, page.schema
        self._wake, self._on_event_loop = page.wake, page.on_event_loop
        self._samples, self._presets = _training_samples(page.model), presets(page.schema)
        self._sliders: dict[str, viser.GuiSliderHandle[float]] = {}
        self._strips: dict[str, viser.GuiHtmlHandle] = {}
        self._lock = threading.RLock()
        self._gui = page.server.gui
        load = load_of_scene(self._schema.scene)
        with self._gui.add_folder("Parameters" if load is None else load.name.capitalize()):
            self._body = ObjectChoice(page) if self._schema.objects else None
            for parameter in self._schema.parameters:
                self._add_slider(parameter)
            self._preset = self._gui.add_dropdown(
                "preset",
                (NO_PRESET, *self._presets),
                hint="values worth seeing" if load else "corners of the trained range",
            )
            self._handled_preset = self._preset.value
            self._preset.on_update(self._choose)
            reset = self._gui.add_button_group("reset", ("all",), hint="to the defaults")
            reset.on_click(self._reset)
        page.controls.parameters, page.controls.set_parameters = self.parameters, self.set
        if self._body is not None:
            self._body.changed()
            self._show_body()
            page.on_columns_changed(self._follow_body)
        self._refresh()

    @classmethod
    def needed(cls, page: Page) -> bool:
        return contacts_of(page.schema) is None

    def _add_slider(self, parameter: Parameter) -> None:
        low, high = slider_range(parameter)
        name, unit = parameter_title(parameter), unit_text(parameter.unit)
        hint, marks = description_of(self._schema, parameter), None
        if parameter.role != "body":
            hint += f"; {known_range(self._schema)} {parameter.low:.3g} to {parameter.high:.3g} {unit}"
            marks = tuple((end, f"{end:.3g}") for end in (parameter.low, parameter.high))
        slider = self._gui.add_slider(
            f"{name} ({unit})" if unit else name,
            min=round(low, 4),
            max=round(high, 4),
            step=slider_step(low, high),
            initial_value=parameter.default,
            marks=marks,
            hint=hint,
        )
        slider.on_update(lambda _: self._moved())
        self._sliders[parameter.name] = slider
        if parameter.role == "physical":
            self._strips[parameter.name] = self._gui.add_html("")

    def parameters(self) -> dict[str, Any]:
        """The values of the sliders, and the object. `InputError` for values that no slider can have."""
        with self._lock:
            if self._body is not None and self._body.changed():
                self._show_body()
            values = self._values()
        for name, slider in self._sliders.items():
            if not slider.min <= values[name] <= slider.max:
                expected = f"expected a finite number from {slider.min:g} to {slider.max:g}"
                raise InputError(f"{name}: {expected}, got {values[name]:g}")
        return {**self._of_object(), **values}

    def set(self, parameters: Mapping[str, Any]) -> None:
        """Move the sliders of these names. `InputError` for unknown names and values that no motion can have."""
        complete = self._schema.complete(parameters)
        with self._lock:
            if self._body is not None and OBJECT in parameters and self._body.choose(str(parameters[OBJECT])):
                self._show_body()
            for name in parameters.keys() & self._sliders.keys():
                slider = self._sliders[name]
                slider.value = min(max(complete[name], slider.min), slider.max)
        self._wake()

    def _of_object(self) -> dict[str, str]:
        return {} if self._body is None else {OBJECT: self._body.name}

    def _show_body(self) -> None:
        """Let the sliders of the body be those of the chosen object, as it is by itself."""
        assert self._body is not None
        own = self._own()
        self._presets = {name: {**preset, **own} for name, preset in self._presets.items()}
        for parameter in self._body.parameters:
            slider = self._sliders[parameter.name]
            slider.min, slider.max = _rounded(parameter.low), _rounded(parameter.high)
            slider.step, slider.value = _rounded(parameter.low / 50.0), own[parameter.name]

    def _own(self) -> dict[str, float]:
        """The properties of the body as it is by itself, to the digits that sliders show."""
        return {} if self._body is None else {name: _rounded(value) for name, value in self._body.own.items()}

    def _follow_body(self) -> None:
        """After another shape was loaded, mass and stiffness are its own."""
        with self._lock:
            if self._body is not None and self._body.changed():
                self._show_body()

    def describe(self, description: Description) -> None:
        self._refresh()

    def restore(self, state: PageState) -> None:
        self.set(state.parameters)

    def _values(self) -> dict[str, float]:
        return {name: slider.value for name, slider in self._sliders.items()}

    async def _choose(self, event: viser.GuiEvent) -> None:
        # a coroutine runs soon where the message arrives, before a drag that follows it
        self._handled_preset = self._preset.value
        if event.client_id is not None and self._preset.value in self._presets:
            self.set(self._presets[self._preset.value])
        else:
            self._refresh_preset()

    async def _reset(self, event: viser.GuiEvent) -> None:
        # likewise
        self.set({**{p.name: p.default for p in self._schema.parameters}, **self._own()})

    def _moved(self) -> None:
        """Show what the sliders say. Where they are back before a frame has followed them, none follows."""
        self._wake()
        self._on_event_loop(self._refresh_preset)

    def _refresh(self) -> None:
        """Let the preset and the marks below the sliders follow the sliders."""
        values = self._values()
        self._on_event_loop(self._refresh_preset)
        own = () if self._body is None else self._body.parameters
        known, parameters = known_range(self._schema), (*own, *self._schema.parameters)
        for name, strip in self._strips.items():
            parameter = next(p for p in parameters if p.name == name)
            set_content(strip, samples_svg(parameter, self._samples.get(name), values[name], known))

    def _refresh_preset(self) -> None:
        if self._preset.value != self._handled_preset:
            return  # a choice has arrived, and its callback has yet to read it
        values = self._values()
        preset = next((name for name, preset in self._presets.items() if preset == values), NO_PRESET)
        if self._preset.value != preset:
            self._preset.value = self._handled_preset = preset


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")
