"""Curves of all columns over time."""

from odeform_viz.colors import color_of
from odeform_viz.page import Page, Panel
from odeform_viz.panels.plots_svg import WIDTH, Line, cursor_svg, plots_svg, quantities_of
from odeform_viz.view import Description

__all__ = ["PlotPanel"]

ROTATES = 1.0  # degrees; bodies that turn less have no plot of it


class PlotPanel(Panel):
    """Two layers: the curves, sent when a motion changes, and the cursor, sent with the time."""

    def __init__(self, page: Page) -> None:
        self._window, self._layout = page.schema.window, page.layout
        self._curves = page.server.gui.add_html("")
        self._cursor = page.server.gui.add_html("")
        self._lines: list[Line] = []
        self._rotates = False

    def describe(self, description: Description) -> None:
        frame = description.frame
        lines = [
            (shown.column.label, color_of(shown.column), curves)
            for shown, curves in zip(frame.columns, description.curves, strict=True)
        ]
        if [id(c) for _, _, c in lines] != [id(c) for _, _, c in self._lines]:
            self._lines = lines
            self._rotates = any(float(c.rotation.max()) > ROTATES for _, _, c in lines)
            self._curves.content = plots_svg(lines, self._window, self._rotates)
            self._layout.set_bottom_width(WIDTH * max(len(quantities_of(lines, self._rotates)), 3) + 40)
        self._cursor.content = cursor_svg(lines, self._window, self._rotates, frame.request.time)
