"""Curves of all columns as SVG, and the current time over them."""

from collections.abc import Sequence

import numpy as np

from odeform.schema import Window
from odeform.types import Floats
from odeform_viz.colors import Color
from odeform_viz.view import REACH, Curves

__all__ = ["WIDTH", "Line", "cursor_svg", "plots_svg", "quantities_of"]

WIDTH, HEIGHT, LEFT, TOP, FOOT = 208, 112, 34, 18, 16  # px of one plot and its margins
WIDE, HIGH = WIDTH - LEFT - 6, HEIGHT - TOP - FOOT  # px of the area that is drawn on
LABELS = 6  # columns whose values are written beside the cursor; more do not fit

Line = tuple[str, Color, Curves]
"""Label, colour and curves of one column."""

STYLE = (
    f".at{{display:block;position:relative;top:-{HEIGHT}px;height:{HEIGHT}px;margin-bottom:-{HEIGHT}px;width:100%;"
    "overflow:visible;font:10px sans-serif}.at path{stroke:#222}"
    ".at text{text-anchor:end;stroke:#fff;stroke-width:2.5px;paint-order:stroke}"
)
"""Style of the cursor, which is sent with every frame, so its attributes are sent once, with the curves."""

QUANTITIES = (
    ("height", "height of the centre, m"),
    ("rotation", "rotation, degrees"),
    ("deformation", "deformation RMS, mm"),
)
ERROR = ("error", "error RMS, mm (dashed: 90 %)")


def quantities_of(lines: Sequence[Line], rotates: bool) -> list[tuple[str, str]]:
    """Attribute of `Curves` and title of each plot; rotation only if a body `rotates`, the error only if known."""
    quantities = [q for q in QUANTITIES if q[0] != "rotation" or rotates]
    known = any(c.error is not None or c.error_band is not None for _, _, c in lines)
    return [*quantities, ERROR] if known else quantities


def plots_svg(lines: Sequence[Line], window: Window, rotates: bool) -> str:
    """One plot per quantity, side by side, with a style sheet for `cursor_svg`."""
    quantities = quantities_of(lines, rotates)
    plots = [_plot(index, name, title, lines, window) for index, (name, title) in enumerate(quantities)]
    return (
        f"<style>{STYLE}</style>"
        f'<svg width="{WIDTH * len(quantities)}" height="{HEIGHT}" font-family="sans-serif" font-size="10" '
        f'style="display:block">{"".join(plots)}</svg>'
    )


def cursor_svg(lines: Sequence[Line], window: Window, rotates: bool, time: float) -> str:
    """A line at `time` in seconds over all plots, with the values there; drawn over `plots_svg`."""
    quantities = quantities_of(lines, rotates)
    share = (time - window.start) / (REACH * (window.stop - window.start))
    index, x = share * (len(lines[0][2].times) - 1) if lines else 0.0, LEFT + share * WIDE
    marks = f"M{x:.0f} {TOP}v{HIGH}" + f"m{WIDTH}-{HIGH}v{HIGH}" * (len(quantities) - 1)
    texts = "".join(
        f'<g fill="#{bytes(color).hex()}">{_values(curves, quantities, index, TOP + 10 + 11 * row)}</g>'
        for row, (_, color, curves) in enumerate(lines[:LABELS])
    )
    return f'<svg class="at"><path d="{marks}"/>{texts}</svg>'


def _plot(index: int, name: str, title: str, lines: Sequence[Line], window: Window) -> str:
    end = window.start + REACH * (window.stop - window.start)
    values = [(color, getattr(c, name), "") for _, color, c in lines if getattr(c, name) is not None]
    if name == "error":
        dashes = ' stroke-dasharray="3 2"'
        values += [(color, c.error_band, dashes) for _, color, c in lines if c.error_band is not None]
    top = _axis_top([v for _, v, _ in values])
    trained = WIDE / REACH
    x = np.linspace(0.0, WIDE, len(lines[0][2].times)) if lines else np.zeros(0)
    curves = "".join(
        f'<path d="{_path(x, HIGH - np.clip(v / top, 0.0, 1.05) * HIGH)}" fill="none" '
        f'stroke="rgb{color}" stroke-width="1.4"{dashes}/>'
        for color, v, dashes in values
    )
    return (
        f'<g transform="translate({WIDTH * index + LEFT},{TOP})">'
        f'<rect width="{WIDE}" height="{HIGH}" fill="#fff"/>'
        f'<rect x="{trained:.1f}" width="{WIDE - trained:.1f}" height="{HIGH}" fill="#f3e3d3"/>'
        f'<path d="M0 0V{HIGH}H{WIDE}" fill="none" stroke="#999"/>'
        f'<text x="0" y="-6" fill="#333">{title}</text>'
        f'<text x="-4" y="8" text-anchor="end" fill="#666">{top:.3g}</text>'
        f'<text x="-4" y="{HIGH}" text-anchor="end" fill="#666">0</text>'
        f'<text x="0" y="{HIGH + 12}" fill="#666">{window.start:g}</text>'
        f'<text x="{trained:.1f}" y="{HIGH + 12}" text-anchor="middle" fill="#666">{window.stop:g} s</text>'
        f'<text x="{WIDE}" y="{HIGH + 12}" text-anchor="end" fill="#666">{end:.3g}</text>'
        f"{curves}</g>"
    )


def _axis_top(values: list[Floats]) -> float:
    """A round number above all values; 1 if there are none."""
    largest = max((float(np.nanmax(v, initial=0.0)) for v in values), default=0.0)
    if largest <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(largest))
    return float(next(s * power for s in (1.0, 1.5, 2.0, 3.0, 5.0, 7.5, 10.0) if s * power >= largest * (1 - 1e-9)))


def _path(x: Floats, y: Floats) -> str:
    """SVG path data, with gaps where y is not a number."""
    parts, pen = [], "M"
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        if b != b:
            pen = "M"
            continue
        parts.append(f"{pen}{a:.1f} {b:.1f}")
        pen = "L"
    return "".join(parts)


def _values(curves: Curves, quantities: list[tuple[str, str]], index: float, y: int) -> str:
    texts = [(column, _value(getattr(curves, name), index)) for column, (name, _) in enumerate(quantities)]
    return "".join(f'<text x="{WIDTH * (column + 1) - 8}" y="{y}">{text}</text>' for column, text in texts if text)


def _value(curve: Floats | None, index: float) -> str:
    if curve is None:
        return ""
    value = curve[min(round(index), len(curve) - 1)]
    return "–" if np.isnan(value) else f"{value:.3g}" if abs(value) >= 0.01 or value == 0.0 else "<0.01"
