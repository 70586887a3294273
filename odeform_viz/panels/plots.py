"""Curves of all columns over time, with a cursor and a legend."""

import threading

import numpy as np

from odeform_viz.colors import color_of
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.panels.plot_legend import ENLARGE, legend_html, values_html
from odeform_viz.panels.plots_svg import WIDTH, Line, cursor_css, plots_html, quantities_of
from odeform_viz.rendering.framing import free_area
from odeform_viz.view import Description, DisplayOptions

__all__ = ["PlotPanel"]

ROTATES = 1.0  # degrees; bodies that turn less have no plot of it
OUTDATED = "<style>.odeform-plots{opacity:0.3}</style>"
MARGIN, LARGE = 40, 860  # px; around the plots, and the width of two large ones


class PlotPanel(Panel):
    """The curves, sent when a motion changes; the cursor and the legend, sent with the time."""

    def __init__(self, page: Page) -> None:
        self._window, self._layout, self._slider = page.schema.window, page.layout, page.controls.time_slider
        gui = page.server.gui
        self._curves, self._cursor, self._legend = gui.add_html(""), gui.add_html(""), gui.add_html("")
        self._state = gui.add_html("")
        self._lines: list[Line] = []
        self._described: Description | None = None
        self._viewport = DisplayOptions().viewport
        self._rotates = self._large = False
        self._drawing = threading.Lock()  # a key may be pressed while other columns are described
        page.add_hotkey(ENLARGE, "larger or smaller plots", self._resize)

    def outdate(self) -> None:
        set_content(self._state, OUTDATED)

    def describe(self, description: Description) -> None:
        set_content(self._state, "")
        with self._drawing:
            self._describe(description)

    def _describe(self, description: Description) -> None:
        frame, viewport = description.frame, description.options.viewport
        lines = [
            (shown.column.label, color_of(shown.column), curves)
            for shown, curves in zip(frame.columns, description.curves, strict=True)
        ]
        drawn = [(name, color, id(c)) for name, color, c in self._lines]
        if [(label, color, id(c)) for label, color, c in lines] != drawn or viewport != self._viewport:
            self._lines, self._viewport = lines, viewport
            self._rotates = any(float(np.nanmax(c.rotation)) > ROTATES for _, _, c in lines)
            self._draw()
        self._described = description
        self._follow(description)

    def _resize(self) -> None:
        with self._drawing:
            self._large = not self._large
            self._draw()
            if self._described is not None:
                self._follow(self._described)

    def _draw(self) -> None:
        plots = max(len(quantities_of(self._lines, self._rotates)), 3)
        width = LARGE if self._large else WIDTH * plots + MARGIN
        left, _, right, _ = free_area(self._viewport)
        self._curves.content = plots_html(self._lines, self._window, self._rotates, self._slider, self._large)
        self._layout.set_bottom_width(min(width, round(right - left)))

    def _follow(self, description: Description) -> None:
        frame, lines = description.frame, self._lines
        time = frame.request.time
        set_content(self._cursor, cursor_css(self._window, time))
        legend = legend_html(lines, self._large)
        if self._large:
            legend += values_html(frame.columns, lines, quantities_of(lines, self._rotates), time)
        set_content(self._legend, legend)
