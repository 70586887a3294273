"""Sliders of the scene's parameters, where they were trained, presets; and how finely to integrate."""

import math
from collections.abc import Callable, Mapping

import numpy as np
import viser

from odeform.errors import InputError
from odeform.schema import Parameter, Schema
from odeform.types import Floats

__all__ = ["ParameterPanel", "presets", "slider_range"]

OWN = "–"  # stands for values that are no preset
BEYOND = 0.2  # of the trained span that a slider reaches beyond it
TICKS = 160  # places along a slider that a training sample can be seen at


def slider_range(parameter: Parameter) -> tuple[float, float]:
    """Low and high end of a slider: somewhat past the trained range, except for angles of a symmetry and zero."""
    if parameter.role == "azimuth":
        return parameter.low, parameter.high
    margin = BEYOND * (parameter.high - parameter.low)
    low = parameter.low - margin
    if parameter.low >= 0.0:
        low = max(low, 0.5 * parameter.low)
    return low, parameter.high + margin


def slider_step(low: float, high: float) -> float:
    """A decimal that divides the slider into 200 steps or more: what is read off it has no digits to spare."""
    return 10.0 ** math.floor(math.log10((high - low) / 200.0))


def presets(schema: Schema) -> dict[str, dict[str, float]]:
    """The defaults, and the corners of the trained range of the first two learned parameters."""
    defaults = {p.name: p.default for p in schema.parameters}
    out = {"defaults": defaults}
    first, second = schema.learned[0], schema.learned[min(1, len(schema.learned) - 1)]
    for one in ("low", "high"):
        for two in ("low", "high"):
            if first is not second:
                name = f"{one} {first.name}, {two} {second.name}"
                out[name] = {**defaults, first.name: getattr(first, one), second.name: getattr(second, two)}
    return out


def samples_svg(parameter: Parameter, samples: Floats | None, value: float) -> str:
    """Where on a slider the training samples lie, and a warning where the value is beyond them."""
    low, high = slider_range(parameter)
    inside = parameter.inside(value)

    def at(x: float) -> float:
        return 100.0 * (x - low) / (high - low)

    band = (
        f'<rect x="{at(parameter.low):.1f}%" width="{at(parameter.high) - at(parameter.low):.1f}%" y="0" height="5" '
        f'fill="#dfe6ee"/>'
    )
    marks = ""
    if samples is not None:
        places = np.unique(np.round((samples - low) / (high - low) * TICKS).astype(int))
        marks = "".join(
            f'<rect x="{100.0 * p / TICKS:.2f}%" width="1" y="0" height="5" fill="#4a6a8c"/>' for p in places
        )
    warning = (
        ""
        if inside
        else f'<div style="color:#b3450c;font-size:0.75em">⚠ beyond the trained '
        f"{parameter.low:.3g} to {parameter.high:.3g} {parameter.unit}</div>"
    )
    return (
        f'<div style="margin:-0.2em 4.5em 0.1em 7.6em"><svg width="100%" height="5" style="display:block">{band}{marks}'
        f"</svg>{warning}</div>"
    )


class ParameterPanel:
    """One slider a parameter, with its unit, its trained range and the samples in it."""

    def __init__(
        self,
        server: viser.ViserServer,
        schema: Schema,
        samples: Mapping[str, Floats],
        wake: Callable[[], None],
    ) -> None:
        """`samples` are the values of the training sequences by parameter."""
        self._schema, self._samples = schema, samples
        self._sliders: dict[str, viser.GuiSliderHandle[float]] = {}
        self._strips: dict[str, viser.GuiHtmlHandle] = {}
        self._presets = presets(schema)
        gui = server.gui
        with gui.add_folder("Parameters"):
            for parameter in schema.parameters:
                low, high = slider_range(parameter)
                slider = gui.add_slider(
                    f"{parameter.name} ({parameter.unit})",
                    min=round(low, 4),
                    max=round(high, 4),
                    step=slider_step(low, high),
                    initial_value=parameter.default,
                    marks=((parameter.low, f"{parameter.low:.3g}"), (parameter.high, f"{parameter.high:.3g}")),
                    hint=f"{parameter.description}; trained from {parameter.low:.3g} to {parameter.high:.3g}",
                )
                slider.on_update(lambda _: wake())
                self._sliders[parameter.name] = slider
                if parameter.role != "azimuth":
                    self._strips[parameter.name] = gui.add_html("")
            self._preset = gui.add_dropdown("preset", (OWN, *self._presets), hint="corners of the trained range")
            self._preset.on_update(self._choose)
            reset = gui.add_button_group("reset", ("all", *(p.name for p in schema.parameters)))
            reset.on_click(self._reset)
        self.show()

    async def _choose(self, event: viser.GuiEvent) -> None:
        # a coroutine runs at once where the message came in, before the worker shows what the sliders still say
        if event.client_id is not None and self._preset.value in self._presets:
            self.set(self._presets[self._preset.value])

    async def _reset(self, event: viser.GuiEvent) -> None:
        # so does this, before a drag that follows it
        name, defaults = event.target.value, self._presets["defaults"]
        self.set(defaults if name == "all" else {n: v for n, v in defaults.items() if n == name})

    def set(self, parameters: Mapping[str, float]) -> None:
        """Move the sliders of these. `InputError` for what the scene has not or no motion can have."""
        complete = self._schema.complete(parameters)
        for name in parameters:
            slider = self._sliders[name]
            slider.value = min(max(complete[name], slider.min), slider.max)

    def parameters(self) -> dict[str, float]:
        """What the sliders say. `InputError` for what no hand could move them to."""
        values = {name: slider.value for name, slider in self._sliders.items()}
        for name, slider in self._sliders.items():
            if not slider.min <= values[name] <= slider.max:
                reach = f"from {slider.min:g} to {slider.max:g}"
                raise InputError(f"{name}: expected a finite number {reach}, got {values[name]:g}")
        return values

    def show(self) -> None:
        """Refresh what stands at the sliders; called by the worker."""
        values = {name: slider.value for name, slider in self._sliders.items()}
        preset = next((name for name, preset in self._presets.items() if preset == values), OWN)
        if self._preset.value != preset:
            self._preset.value = preset
        for parameter in self._schema.parameters:
            strip = self._strips.get(parameter.name)
            if strip is not None:
                content = samples_svg(parameter, self._samples.get(parameter.name), values[parameter.name])
                if strip.content != content:
                    strip.content = content
