"""Curves of all columns over time as SVG, in the colors of the page's theme."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from odeform.schema import Window
from odeform.types import Floats
from odeform_viz.colors import Color
from odeform_viz.view import Curves, shown_until

__all__ = ["WIDTH", "Line", "Quantity", "cursor_css", "plots_html", "quantities_of"]

WIDTH, HEIGHT, LEFT, TOP, FOOT = 208, 100, 34, 18, 16  # units of the drawing, of one plot and its margins
WIDE, HIGH = WIDTH - LEFT - 6, HEIGHT - TOP - FOOT  # the area that is drawn on

FAR = 100.0  # heights of a plot; curves are drawn no farther away, where nobody sees them

Line = tuple[str, Color, Curves]
"""Label, color and curves of one column."""


@dataclass(frozen=True)
class Quantity:
    """An attribute of `Curves`, the title of its plot, its unit, and the digits after the point that are of use."""

    name: str
    title: str
    unit: str
    digits: int


QUANTITIES = (
    Quantity("height", "height of the centre", "m", 3),
    Quantity("rotation", "rotation", "°", 1),
    Quantity("deformation", "deformation, RMS", "mm", 2),
    Quantity("error", "error", "mm", 2),
)
DASHED = " (dashed: expected)"

STYLE = """<style>
.odeform-plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(96px,1fr));padding:0 0.4em}
.odeform-plots.large{grid-template-columns:1fr 1fr}
.odeform-plots.large text{font-size:7px}
.odeform-plots svg{cursor:crosshair;touch-action:none;user-select:none}
.odeform-plots text{font-family:sans-serif;font-size:10px;fill:var(--mantine-color-text);stroke:none}
.odeform-plots svg svg{overflow:hidden}
.odeform-plots .quiet{opacity:0.65}
.odeform-plots .area{fill:var(--mantine-color-body)}
.odeform-plots .beyond{fill:#d08a40;opacity:0.22}
.odeform-plots .axis{stroke:var(--mantine-color-text);opacity:0.5;fill:none}
.odeform-plots .curve{fill:none;stroke-width:1.4;vector-effect:non-scaling-stroke}
.odeform-plots .cursor{stroke:var(--mantine-color-text);stroke-width:1;vector-effect:non-scaling-stroke}
[data-mantine-color-scheme=dark] :is(.odeform-plots .curve,.odeform-swatch){filter:brightness(1.2)}
</style>"""


def quantities_of(lines: Sequence[Line], rotates: bool) -> list[Quantity]:
    """The quantities to plot: rotation only if a body `rotates`, the error only if it or its band is known."""
    expected = any(c.error_band is not None for _, _, c in lines)
    known = expected or any(c.error is not None for _, _, c in lines)
    hidden = {"rotation": not rotates, "error": not known}
    shown = [q for q in QUANTITIES if not hidden.get(q.name, False)]
    return [replace(q, title=f"{q.title}{DASHED}") if q.name == "error" and expected else q for q in shown]


def plots_html(lines: Sequence[Line], window: Window, rotates: bool, slider: str = "", large: bool = False) -> str:
    """Returns one plot per quantity, in a row or `large`, in two columns.

    A click on a plot goes to that time, by the number box of the slider with the id `slider`.
    """
    end = shown_until(window)
    data = f'data-time-slider="{slider}" data-start="{window.start:g}" data-stop="{end:g}"'
    data += f' data-left="{LEFT}" data-right="{LEFT + WIDE}"'
    plots = "".join(
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" {data}>{_plot(quantity, lines, window)}</svg>'
        for quantity in quantities_of(lines, rotates)
    )
    return f'{STYLE}<div class="odeform-plots{" large" if large else ""}">{plots}</div>'


def cursor_css(window: Window, time: float) -> str:
    """A style that moves the cursors of all plots to `time` in seconds; sent instead of the plots."""
    fraction = (time - window.start) / (shown_until(window) - window.start)
    return f"<style>.odeform-plots .cursor{{transform:translateX({fraction * WIDE:.1f}px)}}</style>"


def _plot(quantity: Quantity, lines: Sequence[Line], window: Window) -> str:
    end = shown_until(window)
    curves = _curves(quantity.name, lines)
    low, high = _axis([v[: _trained(c.times, window)] for c, _, v, _ in curves])
    trained = WIDE * (window.stop - window.start) / (end - window.start)
    largest = max((float(np.nanmax(v, initial=high)) for _, _, v, _ in curves), default=high)
    cut = (
        f'<text x="{WIDE}" y="-6" text-anchor="end" class="quiet">↑ {_short(largest)}</text>' if largest > high else ""
    )
    return (
        f'<g transform="translate({LEFT},{TOP})">'
        f'<rect class="area" width="{WIDE}" height="{HIGH}"/>'
        f'<rect class="beyond" x="{trained:.1f}" width="{WIDE - trained:.1f}" height="{HIGH}"/>'
        f'<path class="axis" d="M0 0V{HIGH}H{WIDE}"/>'
        f'<text x="-28" y="-6">{quantity.title}, {quantity.unit}</text>'
        f'<text class="quiet" x="-4" y="8" text-anchor="end">{high:.3g}</text>'
        f'<text class="quiet" x="-4" y="{HIGH}" text-anchor="end">{low:.3g}</text>'
        f'<text class="quiet" x="0" y="{HIGH + 12}">{window.start:g}</text>'
        f'<text class="quiet" x="{trained:.1f}" y="{HIGH + 12}" text-anchor="middle">{window.stop:g} s</text>'
        f'<text class="quiet" x="{WIDE}" y="{HIGH + 12}" text-anchor="end">{end:.3g}</text>'
        f'<svg width="{WIDE}" height="{HIGH}">'
        f"{''.join(_curve(c, color, v, dashes, low, high) for c, color, v, dashes in curves)}</svg>"
        f'{cut if largest > high else ""}<path class="cursor" d="M0 0v{HIGH}"/></g>'
    )


def _curves(name: str, lines: Sequence[Line]) -> list[tuple[Curves, Color, Floats, str]]:
    """Curves, color, values (T,) and attributes of each curve of one plot."""
    out = [(c, color, getattr(c, name), "") for _, color, c in lines if getattr(c, name) is not None]
    if name == "error":
        dashes = ' stroke-dasharray="3 2"'
        out += [(c, color, c.error_band, dashes) for _, color, c in lines if c.error_band is not None]
    return out


def _trained(times: Floats, window: Window) -> int:
    """The number of `times` up to the end of the trained window."""
    return int(np.searchsorted(times, window.stop + 0.5 / window.rate))


def _axis(values: list[Floats]) -> tuple[float, float]:
    """Round ends of an axis that holds all values and zero; 0 and 1 if there are none. What dips below zero by less
    than the width of a line has no end of its own."""
    high = _round_up(max((float(np.nanmax(v, initial=0.0)) for v in values), default=0.0))
    lowest = max((float(np.nanmax(-v, initial=0.0)) for v in values), default=0.0)
    low = 0.0 - _round_up(lowest if lowest > high / HIGH else 0.0)
    return low, high or (1.0 if low == 0.0 else 0.0)


def _round_up(largest: float) -> float:
    if largest <= 0.0:
        return 0.0
    power = 10.0 ** np.floor(np.log10(largest))
    return float(next(s * power for s in (1.0, 1.5, 2.0, 3.0, 5.0, 7.5, 10.0) if s * power >= largest * (1 - 1e-9)))


def _short(value: float) -> str:
    """Three digits, without an exponent."""
    return f"{value:.3g}" if value < 1000.0 else f"{value:,.0f}"


def _curve(curves: Curves, color: Color, values: Floats, dashes: str, low: float, high: float) -> str:
    """A path that leaves the plot beyond the ends of the axis, with gaps where values are not known."""
    span = curves.times[-1] - curves.times[0]
    x = (curves.times - curves.times[0]) / span * WIDE
    y = HIGH * (1.0 - np.clip((values - low) / (high - low), -FAR, FAR))
    parts, pen = [], "M"
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        if b != b:
            pen = "M"
            continue
        parts.append(f"{pen}{a:.1f} {b:.1f}")
        pen = "L"
    return f'<path class="curve" d="{"".join(parts)}" stroke="rgb{color}"{dashes}/>'
