"""The map of stability as a drawing: one square per moment, ticks, what the colours mean, and places to click."""

import base64
import io
import math
from collections.abc import Mapping
from html import escape

import numpy as np
from PIL import Image

from odeform.formats.picture_files import Picture
from odeform.schema import Parameter
from odeform.stress.stability import StabilityMap
from odeform_viz.coloring.scale import colors_of
from odeform_viz.view import ColorScale
from odeform_viz.words import parameter_title

__all__ = ["here_css", "map_html", "place_of"]

SIDE, LEFT, TOP, FOOT, GAP = 108, 34, 16, 16, 16  # units of the drawing, which are px in the panel
NAMES = 14  # for the name of the parameter below
BAR = 12  # width of the bar of the colours
TOP_OF_COLOURS = 2.0  # over the largest change of shape in the trained range
CLAMPED = (70, 70, 74)
TICKS = (-3.0, -1.0, 1.0, 3.0)  # halves of the trained range, from its middle
STYLE = (
    ".odeform-map{display:block;padding:0 0.5em}"
    ".odeform-map text{font:9.5px Inter,sans-serif;fill:var(--mantine-color-text)}"
    ".odeform-map image[data-map]{cursor:crosshair;image-rendering:pixelated}"
    ".odeform-map .here{fill:#d66030;stroke:#fff;stroke-width:1.5}"
)


def map_html(plot: StabilityMap, parameters: tuple[Parameter, Parameter]) -> str:
    """Draws the map, two moments in a row, and what its colours mean in the next place.

    A click writes "across,upwards,moment", the first two as fractions, into the text box after it.
    """
    count = len(plot.times)
    places = [_corner(index) for index in range(count + 1)]
    panels = "".join(_panel(plot, index, parameters, *places[index]) for index in range(count))
    width, height = LEFT + 2 * (SIDE + GAP), places[-1][1] + SIDE + FOOT + NAMES
    x, y = parameters
    names = (
        f'<text x="{LEFT + 0.5 * SIDE}" y="{height - 4}" text-anchor="middle">{_named(x)}</text>'
        f'<text transform="translate(9,{0.5 * height}) rotate(-90)" text-anchor="middle">{_named(y)}</text>'
    )
    legend = _legend(1e3 * plot.largest, *places[-1])
    return (
        f'<svg class="odeform-map" viewBox="0 0 {width} {height}" width="100%">'
        f"<style>{STYLE}</style>{panels}{legend}{names}</svg>"
    )


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


def _corner(index: int) -> tuple[int, int]:
    """Left and top of a place."""
    row, column = divmod(index, 2)
    return LEFT + column * (SIDE + GAP), TOP + row * (TOP + SIDE + FOOT)


def _scale(largest: float) -> ColorScale:
    """Colours up to twice the `largest` change of shape in the trained range, in mm."""
    return ColorScale("displacement", "mm", TOP_OF_COLOURS * largest, False)


def _panel(plot: StabilityMap, index: int, parameters: tuple[Parameter, Parameter], left: int, top: int) -> str:
    reach, largest = _reach(plot), 1e3 * plot.largest
    colors = colors_of(largest * plot.values[index], _scale(largest))
    cells = np.where(plot.sound[index][..., None], colors, CLAMPED).astype(np.uint8)

    def at(unit: float) -> float:
        return 0.5 * SIDE * (1.0 + unit / reach)

    low, high = at(-1.0), at(1.0)
    windows = plot.times[index] / plot.window
    when = f"{plot.times[index]:.3g} s" + ("" if windows <= 1.0 else f" ({windows:g} × trained)")
    parts = [
        f'<text x="{left + 0.5 * SIDE}" y="{top - 4}" text-anchor="middle">{when}</text>',
        f'<image href="{_png(cells[::-1])}" x="{left}" y="{top}" width="{SIDE}" height="{SIDE}" '
        f'preserveAspectRatio="none" data-map="{index}"/>',
        f'<rect x="{left + low:.1f}" y="{top + low:.1f}" width="{high - low:.1f}" height="{high - low:.1f}" '
        'fill="none" stroke="#fff" stroke-width="1.5" pointer-events="none"/>',
        f'<g transform="translate({left},{top})" pointer-events="none"><circle class="here" r="3.5"/></g>',
    ]
    for unit in TICKS:
        x, y = left + at(unit), top + SIDE - at(unit)
        parts.append(
            f'<text x="{x:.1f}" y="{top + SIDE + 11}" text-anchor="middle">{_tick(parameters[0], unit)}</text>'
        )
        if left == LEFT:
            parts.append(f'<text x="{left - 4}" y="{y + 3:.1f}" text-anchor="end">{_tick(parameters[1], unit)}</text>')
    return "".join(parts)


def _legend(largest: float, left: int, top: int) -> str:
    """A bar of the colours, with what they say of a motion beside it; `largest` in the trained range, in mm."""
    colours = _png(colors_of(np.linspace(TOP_OF_COLOURS * largest, 0.0, 128), _scale(largest))[:, None])
    tall, beside = SIDE - 26, left + BAR + 6
    lines = (
        (top + 7, f"≥ {TOP_OF_COLOURS * largest:.3g} mm: bad,"),
        (top + 18, "twice as much or more"),
        (top + 0.5 * tall, f"{largest:.3g} mm: the most"),
        (top + 0.5 * tall + 11, "in the trained range"),
        (top + tall, "0 mm: good, no change"),
        (top + SIDE - 3, "no motion: it stopped"),
    )
    swatch = f'<rect x="{left}" y="{top + SIDE - BAR}" width="{BAR}" height="{BAR}" fill="rgb{CLAMPED}"/>'
    texts = "".join(f'<text x="{beside}" y="{y:.1f}">{escape(text)}</text>' for y, text in lines)
    bar = f'<image href="{colours}" x="{left}" y="{top}" width="{BAR}" height="{tall}" preserveAspectRatio="none"/>'
    return f'{bar}{swatch}{texts}<text x="{left}" y="{top - 5}">change of shape, RMS</text>'


def _named(parameter: Parameter) -> str:
    return f"{parameter_title(parameter)}, {parameter.unit}" if parameter.unit else parameter_title(parameter)


def _tick(parameter: Parameter, unit: float) -> str:
    value = parameter.denormalise(unit)
    return f"{value:.2g}" if math.isfinite(value) else ""


def _png(pixels: Picture) -> str:
    file = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(file, "PNG")
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
