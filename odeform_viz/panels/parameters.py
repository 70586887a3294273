"""Sliders of the scene's parameters, and which models are shown."""

from collections.abc import Callable

import viser

from odeform.errors import InputError
from odeform.schema import Parameter
from odeform_viz.session import Session

__all__ = ["ParameterPanel"]

BEYOND = 0.2  # of the trained span that a slider reaches beyond it


def slider_range(parameter: Parameter) -> tuple[float, float]:
    """Low and high end of a slider: somewhat past the trained range, except for angles of a symmetry and zero."""
    if parameter.role == "azimuth":
        return parameter.low, parameter.high
    margin = BEYOND * (parameter.high - parameter.low)
    low = parameter.low - margin
    if parameter.low >= 0.0:
        low = max(low, 0.5 * parameter.low)
    return low, parameter.high + margin


class ParameterPanel:
    """One slider a parameter, with its unit and its trained range as marks."""

    def __init__(self, server: viser.ViserServer, session: Session, wake: Callable[[], None]) -> None:
        self._sliders: dict[str, viser.GuiSliderHandle[float]] = {}
        self._defaults = {p.name: p.default for p in session.schema.parameters}
        with server.gui.add_folder("Parameters"):
            for parameter in session.schema.parameters:
                low, high = slider_range(parameter)
                slider = server.gui.add_slider(
                    f"{parameter.name} ({parameter.unit})",
                    min=round(low, 4),
                    max=round(high, 4),
                    step=round((high - low) / 1000, 5),
                    initial_value=parameter.default,
                    marks=((parameter.low, f"{parameter.low:.3g}"), (parameter.high, f"{parameter.high:.3g}")),
                    hint=f"{parameter.description}; trained from {parameter.low:.3g} to {parameter.high:.3g}",
                )
                slider.on_update(lambda _: wake())
                self._sliders[parameter.name] = slider
            reset = server.gui.add_button("Reset parameters", color="gray")
            reset.on_click(lambda _: self._reset())
            self._quality = None
            if session.qualities:
                initial = "balanced" if "balanced" in session.qualities else session.qualities[0]
                self._quality = server.gui.add_dropdown(
                    "quality", session.qualities, initial_value=initial, hint="how finely the ODE is integrated"
                )
                self._quality.on_update(lambda _: wake())
            self._visible = []
            if len(session.columns) > 1:
                for column in session.columns:
                    box = server.gui.add_checkbox(column.label, initial_value=True, hint="show this model")
                    box.on_update(lambda _: wake())
                    self._visible.append(box)
        self._known = session.qualities

    def _reset(self) -> None:
        for name, slider in self._sliders.items():
            slider.value = self._defaults[name]

    def parameters(self) -> dict[str, float]:
        return {name: slider.value for name, slider in self._sliders.items()}

    def quality(self) -> str:
        value = self._quality.value if self._quality else "balanced"
        if self._known and value not in self._known:
            raise InputError(f"quality: expected one of {', '.join(self._known)}, got {value!r}")
        return value

    def visible(self) -> tuple[bool, ...]:
        return tuple(bool(box.value) for box in self._visible) or (True,)
