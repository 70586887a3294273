"""The legend of the plots: the color of each column, and, below large plots, its values at the current time."""

from collections.abc import Sequence
from html import escape

import numpy as np

from odeform_viz.colors import Color
from odeform_viz.panels.plots_svg import Line, Quantity
from odeform_viz.view import ColumnFrame, Curves

__all__ = ["ENLARGE", "legend_html", "values_html"]

ENLARGE = "B"  # the hot key of the size of the plots
STYLE = "padding:0 0.8em 0.3em;font:11px/1.5 sans-serif;color:var(--mantine-color-text)"
QUIET = "opacity:0.65"
CUT = (
    "Axes fit the time before the orange part; ↑ is the largest value after it. Deformation and errors are RMS "
    "distances; nine of ten errors are below the dashed line, where there is one."
)


def legend_html(lines: Sequence[Line], large: bool) -> str:
    """Returns one line: the columns, and a button that presses the hot key `ENLARGE`."""
    names = "".join(f"<span>{_swatch(color)}{escape(label)}</span>" for label, color, _ in lines)
    size = "smaller" if large else "larger"
    button = f'<a data-hotkey="{ENLARGE}" style="margin-left:auto;cursor:pointer">{size} ⤢</a>'
    return (
        f'<div title="{CUT}" style="display:flex;gap:1.2em;white-space:nowrap;overflow:hidden;{STYLE}">'
        f"{names}{button}</div>"
    )


def values_html(
    columns: Sequence[ColumnFrame], lines: Sequence[Line], quantities: Sequence[Quantity], time: float
) -> str:
    """A row per column, with its values at `time` in seconds; errors are those of the shown frame itself."""
    heads = "".join(f'<td style="text-align:right;{QUIET}">{q.name}</td>' for q in quantities)
    rows = "".join(
        f"<tr><td>{_swatch(color)}{escape(label)}</td>{''.join(_cell(shown, q, curves, time) for q in quantities)}</tr>"
        for shown, (label, color, curves) in zip(columns, lines, strict=True)
    )
    table = f'<table style="width:100%;border-spacing:0"><tr><td></td>{heads}</tr>{rows}</table>'
    return f'<div style="max-height:9em;overflow-y:auto;{STYLE}">{table}<div style="{QUIET}">{CUT}</div></div>'


def _swatch(color: Color) -> str:
    style = f"display:inline-block;width:1em;height:0.3em;margin:0 0.4em 0.25em 0;background:rgb{color}"
    return f'<i class="odeform-swatch" style="{style}"></i>'


def _cell(shown: ColumnFrame, quantity: Quantity, curves: Curves, time: float) -> str:
    if quantity.name != "error":
        value = float(np.interp(time, curves.times, getattr(curves, quantity.name)))
        text = f"{_number(value, quantity)} {quantity.unit}" if np.isfinite(value) else "–"
    else:
        texts = [] if shown.error is None else [f"{_number(shown.error.rms_mm, quantity)} mm"]
        if (band := shown.error_band(np.array([time]))) is not None:  # as the status says it
            texts.append(f"90 %: {_number(float(band[0, 1]), quantity)} mm")
        text = " · ".join(texts) or "–"
    return f'<td style="text-align:right;font-variant-numeric:tabular-nums">{text}</td>'


def _number(value: float, quantity: Quantity) -> str:
    text = f"{value:.{quantity.digits}f}"
    return text if float(text) or value == 0.0 else f"<{10.0**-quantity.digits:g}"
