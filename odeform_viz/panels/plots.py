"""Curves of all columns over time, with the moment that is shown: drawn as SVG, sent when a motion changes."""

from collections.abc import Sequence

import numpy as np
import viser

from odeform.schema import Window
from odeform.types import Floats
from odeform_viz.view import REACH, Curves

__all__ = ["PlotPanel", "plots_svg"]

WIDTH, HEIGHT, LEFT, TOP, FOOT = 208, 112, 34, 18, 16  # px of one plot and its margins
Line = tuple[str, tuple[int, int, int], Curves]
STYLE = (
    f".at{{display:block;position:relative;top:-{HEIGHT}px;height:{HEIGHT}px;margin-bottom:-{HEIGHT}px;width:100%;"
    "overflow:visible;font:10px sans-serif}.at path{stroke:#222}"
    ".at text{text-anchor:end;stroke:#fff;stroke-width:2.5px;paint-order:stroke}"
)
"""Of the moment, which is sent with every frame."""
QUANTITIES = (
    ("height", "height of the centre, m"),
    ("rotation", "rotation, degrees"),
    ("deformation", "deformation RMS, mm"),
)
ERROR = ("error", "error RMS, mm (dashed: 9 in 10)")


def _quantities(lines: Sequence[Line], turns: bool) -> list[tuple[str, str]]:
    wanted = [q for q in QUANTITIES if q[0] != "rotation" or turns]
    known = any(c.error is not None or c.error_band is not None for _, _, c in lines)
    return [*wanted, ERROR] if known else wanted


def _top(values: list[Floats]) -> float:
    largest = max((float(np.nanmax(v, initial=0.0)) for v in values), default=0.0)
    if largest <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(largest))
    return float(next(s * power for s in (1.0, 1.5, 2.0, 3.0, 5.0, 7.5, 10.0) if s * power >= largest * (1 - 1e-9)))


def plots_svg(lines: Sequence[Line], window: Window, turns: bool) -> str:
    """One plot a quantity, side by side. `turns` says whether any body turns enough to be worth a plot."""
    quantities = _quantities(lines, turns)
    plots = [_plot(index, name, title, lines, window) for index, (name, title) in enumerate(quantities)]
    return (
        f"<style>{STYLE}</style>"
        f'<svg width="{WIDTH * len(quantities)}" height="{HEIGHT}" font-family="sans-serif" font-size="10" '
        f'style="display:block">{"".join(plots)}</svg>'
    )


def _plot(index: int, name: str, title: str, lines: Sequence[Line], window: Window) -> str:
    wide, high = WIDTH - LEFT - 6, HEIGHT - TOP - FOOT
    span = REACH * (window.stop - window.start)
    values = [(color, getattr(c, name), "") for _, color, c in lines if getattr(c, name) is not None]
    if name == "error":
        values += [
            (color, c.error_band, ' stroke-dasharray="3 2"') for _, color, c in lines if c.error_band is not None
        ]
    top = _top([v for _, v, _ in values])
    trained = wide / REACH
    x = np.linspace(0.0, wide, len(lines[0][2].times)) if lines else np.zeros(0)
    drawn = "".join(
        f'<path d="{_path(x, high - np.clip(v / top, 0.0, 1.05) * high)}" fill="none" '
        f'stroke="rgb{color}" stroke-width="1.4"{dashes}/>'
        for color, v, dashes in values
    )
    return (
        f'<g transform="translate({WIDTH * index + LEFT},{TOP})">'
        f'<rect width="{wide}" height="{high}" fill="#fff"/>'
        f'<rect x="{trained:.1f}" width="{wide - trained:.1f}" height="{high}" fill="#f3e3d3"/>'
        f'<path d="M0 0V{high}H{wide}" fill="none" stroke="#999"/>'
        f'<text x="0" y="-6" fill="#333">{title}</text>'
        f'<text x="-4" y="8" text-anchor="end" fill="#666">{top:.3g}</text>'
        f'<text x="-4" y="{high}" text-anchor="end" fill="#666">0</text>'
        f'<text x="0" y="{high + 12}" fill="#666">{window.start:g}</text>'
        f'<text x="{trained:.1f}" y="{high + 12}" text-anchor="middle" fill="#666">{window.stop:g} s</text>'
        f'<text x="{wide}" y="{high + 12}" text-anchor="end" fill="#666">{window.start + span:.3g}</text>'
        f"{drawn}</g>"
    )


def _path(x: Floats, y: Floats) -> str:
    """SVG path data; gaps where y is not a number."""
    parts, pen = [], "M"
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        if b != b:
            pen = "M"
            continue
        parts.append(f"{pen}{a:.1f} {b:.1f}")
        pen = "L"
    return "".join(parts)


def _at(curve: Floats | None, place: float) -> str:
    if curve is None:
        return ""
    value = curve[min(round(place), len(curve) - 1)]
    return "–" if np.isnan(value) else f"{value:.3g}" if abs(value) >= 0.01 or value == 0.0 else "<0.01"


def cursor_svg(lines: Sequence[Line], window: Window, turns: bool, moment: float) -> str:
    """The moment as a line over all plots, with the values there; laid over what `plots_svg` drew."""
    quantities = _quantities(lines, turns)
    wide, high = WIDTH - LEFT - 6, HEIGHT - TOP - FOOT
    share = (moment - window.start) / (REACH * (window.stop - window.start))
    place, x = share * (len(lines[0][2].times) - 1) if lines else 0.0, LEFT + share * wide
    # one line for all plots, and no attribute that the style sheet can tell: it is sent with every frame
    marks = f"M{x:.0f} {TOP}v{high}" + f"m{WIDTH}-{high}v{high}" * (len(quantities) - 1)
    texts = "".join(
        f'<g fill="#{bytes(color).hex()}">{_values(curves, quantities, place, TOP + 10 + 11 * row)}</g>'
        for row, (_, color, curves) in enumerate(lines[:6])
    )
    return f'<svg class="at"><path d="{marks}"/>{texts}</svg>'


def _values(curves: Curves, quantities: list[tuple[str, str]], place: float, y: int) -> str:
    known = [(index, _at(getattr(curves, name), place)) for index, (name, _) in enumerate(quantities)]
    return "".join(f'<text x="{WIDTH * (i + 1) - 8}" y="{y}">{text}</text>' for i, text in known if text)


class PlotPanel:
    """Two layers: curves, and the moment over them."""

    def __init__(self, server: viser.ViserServer, window: Window) -> None:
        self._window = window
        self._panel = server.gui.add_panel()
        with self._panel.add_tab("Over time"):
            self._curves = server.gui.add_html("")
            self._cursor = server.gui.add_html("")
        self._panel.float(x=12, y=-12, width=WIDTH * 3 + 40)
        self._lines: list[Line] = []
        self._turns = False

    def tab(self, name: str) -> viser.GuiTabHandle:
        """Room for something else beside the curves."""
        return self._panel.add_tab(name)

    def show(self, lines: list[Line], moment: float) -> None:
        if [id(c) for _, _, c in lines] != [id(c) for _, _, c in self._lines]:
            self._lines = lines
            self._turns = any(float(c.rotation.max()) > 1.0 for _, _, c in lines)
            self._curves.content = plots_svg(lines, self._window, self._turns)
            self._panel.set_width(WIDTH * max(len(_quantities(lines, self._turns)), 3) + 40)
        self._cursor.content = cursor_svg(lines, self._window, self._turns, moment)
