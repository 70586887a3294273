"""The map of stability as a drawing: one panel per moment, ticks, a bar of the colours, and places to click."""

import base64
import io
import math
from collections.abc import Mapping

import numpy as np
from PIL import Image

from odeform.formats.picture_files import Picture
from odeform.schema import Parameter
from odeform.stress.stability import StabilityMap
from odeform_viz.coloring.scale import colors_of
from odeform_viz.view import ColorScale
from odeform_viz.words import parameter_title

__all__ = ["here_css", "map_html", "place_of"]

SIDE, LEFT, TOP, FOOT, GAP = 150, 44, 20, 34, 22  # units of the drawing
CLAMPED = (70, 70, 74)
TICKS = (-3.0, -1.0, 1.0, 3.0)  # halves of the trained range, from its middle


def map_html(plot: StabilityMap, parameters: tuple[Parameter, Parameter]) -> str:
    """Draws the map; a click writes "across,upwards,moment", the first two as fractions, into the text box after it."""
    top = _top(plot)
    width = LEFT + len(plot.times) * (SIDE + GAP)
    panels = "".join(_panel(plot, index, parameters, top) for index in range(len(plot.times)))
    x, y = parameters
    names = (
        f'<text x="{0.5 * width}" y="{TOP + SIDE + 29}" text-anchor="middle">{_named(x)}</text>'
        f'<text transform="translate(9,{TOP + 0.5 * SIDE}) rotate(-90)" text-anchor="middle">{_named(y)}</text>'
    )
    drawing = (
        f'<svg class="odeform-map" viewBox="0 0 {width} {TOP + SIDE + FOOT}" width="100%" style="max-height:230px">'
        f"<style>.odeform-map text{{font:9px sans-serif;fill:var(--mantine-color-text)}}"
        f".odeform-map image{{cursor:crosshair;image-rendering:pixelated}}"
        f".odeform-map .here{{fill:#d66030;stroke:#fff;stroke-width:1.5}}</style>{panels}{names}</svg>"
    )
    bar = _png(colors_of(np.linspace(0.0, top, 256), _scale(top))[None])
    legend = (
        '<div style="display:flex;gap:0.5em;align-items:center;font:11px sans-serif;padding:0 0.8em 0.6em">'
        f'<span>change of shape (RMS) 0</span><img src="{bar}" style="flex:1;height:10px;max-width:16em">'
        f"<span>≥ {top:.3g} mm</span>"
        f'<span style="width:1em;height:10px;background:rgb{CLAMPED}"></span>'
        "<span>stopped: not possible any more</span>"
        "</div>"
    )
    return drawing + legend


def place_of(text: str, plot: StabilityMap, parameters: tuple[Parameter, Parameter]) -> tuple[dict[str, float], float]:
    """The values of the parameters and the seconds that a click means. `ValueError` for a text that is none."""
    across, upwards, moment = (float(part) for part in text.split(","))
    reach = _reach(plot)
    units = (reach * (2.0 * across - 1.0), reach * (2.0 * upwards - 1.0))
    if not all(abs(unit) <= reach for unit in units):
        raise ValueError(f"expected fractions from 0 to 1, got {text!r}")
    values = {p.name: p.denormalise(unit) for p, unit in zip(parameters, units, strict=True)}
    return values, float(plot.times[int(moment)])


def here_css(values: Mapping[str, float], plot: StabilityMap, parameters: tuple[Parameter, Parameter]) -> str:
    """A style that marks parameters of these values on the map; nowhere where they are not on it."""
    units = [float(p.normalise(values[p.name])) / _reach(plot) for p in parameters]
    if not all(abs(unit) <= 1.0 for unit in units):
        return "<style>.odeform-map .here{display:none}</style>"
    x, y = 0.5 * SIDE * (1.0 + units[0]), 0.5 * SIDE * (1.0 - units[1])
    return f"<style>.odeform-map .here{{transform:translate({x:.1f}px,{y:.1f}px)}}</style>"


def _reach(plot: StabilityMap) -> float:
    """From the middle of the map to its edge, in halves of the trained range: the outer cells are whole."""
    return float(plot.units[-1] + 0.5 * (plot.units[1] - plot.units[0]))


def _top(plot: StabilityMap) -> float:
    """mm at the end of the colours: what nine in ten of the valid cells stay below, or the largest trained."""
    valid = 1e3 * plot.largest * plot.values[plot.sound]
    return max(float(np.quantile(valid, 0.9)) if valid.size else 0.0, 1e3 * plot.largest)


def _scale(top: float) -> ColorScale:
    return ColorScale("displacement", "mm", top, False)


def _panel(plot: StabilityMap, index: int, parameters: tuple[Parameter, Parameter], top: float) -> str:
    left, reach = LEFT + index * (SIDE + GAP), _reach(plot)
    values = 1e3 * plot.largest * plot.values[index]
    colors = np.where(plot.sound[index][..., None], colors_of(values, _scale(top)), CLAMPED).astype(np.uint8)

    def at(unit: float) -> float:
        return 0.5 * SIDE * (1.0 + unit / reach)

    low, high = at(-1.0), at(1.0)
    windows = plot.times[index] / plot.window
    when = f"{plot.times[index]:.3g} s" + ("" if windows <= 1.0 else f" ({windows:g} × trained)")
    parts = [
        f'<text x="{left + 0.5 * SIDE}" y="13" text-anchor="middle">{when}</text>',
        f'<image href="{_png(colors[::-1])}" x="{left}" y="{TOP}" width="{SIDE}" height="{SIDE}" '
        f'preserveAspectRatio="none" data-map="{index}"/>',
        f'<rect x="{left + low:.1f}" y="{TOP + low:.1f}" width="{high - low:.1f}" height="{high - low:.1f}" '
        'fill="none" stroke="#fff" stroke-width="1.5" pointer-events="none"/>',
        f'<g transform="translate({left},{TOP})" pointer-events="none"><circle class="here" r="3.5"/></g>',
    ]
    for unit in TICKS:
        x, y = left + at(unit), TOP + SIDE - at(unit)
        parts.append(
            f'<text x="{x:.1f}" y="{TOP + SIDE + 12}" text-anchor="middle">{_tick(parameters[0], unit)}</text>'
        )
        if index == 0:
            parts.append(f'<text x="{left - 4}" y="{y + 3:.1f}" text-anchor="end">{_tick(parameters[1], unit)}</text>')
    return "".join(parts)


def _named(parameter: Parameter) -> str:
    return f"{parameter_title(parameter)}, {parameter.unit}" if parameter.unit else parameter_title(parameter)


def _tick(parameter: Parameter, unit: float) -> str:
    value = parameter.denormalise(unit)
    return f"{value:.2g}" if math.isfinite(value) else ""


def _png(pixels: Picture) -> str:
    file = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(file, "PNG")
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
