"""Panels of points on logarithmic axes, as SVG."""

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

__all__ = ["Series", "scatter"]

WIDE, HIGH, LEFT, TOP, GAP = 380, 300, 56, 34, 30  # px
COLORS = ("#d9480f", "#1c7ed6", "#2f9e44", "#7048e8", "#868e96", "#e8590c")
MARGIN = 1.3  # factor around the outermost points

Series = Mapping[str, Sequence[tuple[float, float]]]
"""Points (x, y), both above zero, by the name of what they are of."""


def scatter(panels: Mapping[str, Series], x: str, y: str) -> str:
    """Draws a panel for each of `panels`, by title, with axes of the same span named `x` and `y`. `ValueError` without
    any point."""
    points = [point for series in panels.values() for each in series.values() for point in each]
    if not points:
        raise ValueError("scatter: expected at least one point")
    low, high = np.min(points, axis=0) / MARGIN, np.max(points, axis=0) * MARGIN
    names = list(dict.fromkeys(name for series in panels.values() for name in series))
    colors = {name: COLORS[index % len(COLORS)] for index, name in enumerate(names)}
    width = LEFT + len(panels) * (WIDE + GAP)
    height = TOP + HIGH + 46 + 20 * (1 + (len(names) - 1) // 4)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" '
        f'font-size="12" fill="#222"><rect width="{width}" height="{height}" fill="#fff"/>'
    ]
    for index, (title, series) in enumerate(panels.items()):
        left = LEFT + index * (WIDE + GAP)
        parts.append(f'<g transform="translate({left} {TOP})">{_panel(title, series, colors, low, high, index == 0)}')
        parts.append(f'<text x="{WIDE / 2}" y="{HIGH + 34}" text-anchor="middle">{escape(x)}</text></g>')
    parts.append(f'<text x="4" y="{TOP - 22}">{escape(y)}</text>')
    for index, name in enumerate(names):
        across, down = LEFT + 200 * (index % 4), TOP + HIGH + 56 + 20 * (index // 4)
        parts.append(f'<circle cx="{across}" cy="{down - 4}" r="5" fill="{colors[name]}"/>')
        parts.append(f'<text x="{across + 10}" y="{down}">{escape(name)}</text>')
    return "".join(parts) + "</svg>\n"


def _panel(
    title: str, series: Series, colors: Mapping[str, str], low: np.ndarray, high: np.ndarray, numbered: bool
) -> str:
    """One panel; only the first has numbers on its vertical axis."""
    span = np.log(high / low)

    def at(x: float, y: float) -> tuple[float, float]:
        part = np.log(np.array([x, y]) / low) / span
        return float(WIDE * part[0]), float(HIGH * (1.0 - part[1]))

    out = [f'<rect width="{WIDE}" height="{HIGH}" fill="none" stroke="#bbb"/><text y="-6">{escape(title)}</text>']
    for tick in _ticks(low[0], high[0]):
        across = at(tick, low[1])[0]
        out.append(f'<line x1="{across:.1f}" x2="{across:.1f}" y2="{HIGH}" stroke="#eee"/>')
        out.append(f'<text x="{across:.1f}" y="{HIGH + 15}" text-anchor="middle">{tick:g}</text>')
    for tick in _ticks(low[1], high[1]):
        down = at(low[0], tick)[1]
        out.append(f'<line x2="{WIDE}" y1="{down:.1f}" y2="{down:.1f}" stroke="#eee"/>')
        if numbered:
            out.append(f'<text x="-6" y="{down + 4:.1f}" text-anchor="end">{tick:g}</text>')
    for name, points in series.items():
        for x, y in points:
            across, down = at(x, y)
            out.append(f'<circle cx="{across:.1f}" cy="{down:.1f}" r="5" fill="{colors[name]}" fill-opacity="0.8"/>')
    return "".join(out)


def _ticks(low: float, high: float) -> list[float]:
    """1, 3, 10 ... within a span."""
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    return [tick for decade in decades for tick in (10.0**decade, 3.0 * 10.0**decade) if low <= tick <= high]
