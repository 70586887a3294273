"""Places panels: in the side panel, in one of its tabs, or in a tab of the panel at the bottom."""

from contextlib import AbstractContextManager, nullcontext

import viser

__all__ = ["Layout"]

BOTTOM_WIDTH = 664  # px
ABOVE = 76  # px; the timeline is below


class Layout:
    """Creates tabs when they are first needed.

    A place is "side" for the side panel itself, "side/TAB" for a tab of it, or "bottom/TAB".
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._gui = server.gui
        self._tabs: viser.GuiTabGroupHandle | None = None
        self._bottom: viser.PanelHandle | None = None
        self._made: dict[str, viser.GuiTabHandle] = {}

    def at(self, place: str) -> AbstractContextManager[object]:
        """Within it, new controls are added to `place`."""
        area, _, tab = place.partition("/")
        if area not in ("side", "bottom") or (area == "bottom" and not tab):
            raise ValueError(f"expected side, side/TAB or bottom/TAB, got {place!r}")
        if not tab:
            return nullcontext()
        if place not in self._made:
            self._made[place] = self._side_tab(tab) if area == "side" else self._bottom_tab(tab)
        return self._made[place]

    def set_bottom_width(self, pixels: int) -> None:
        """Set the width of the bottom panel in pixels, if there is one."""
        if self._bottom is not None:
            self._bottom.set_width(pixels)

    def _side_tab(self, name: str) -> viser.GuiTabHandle:
        if self._tabs is None:
            self._tabs = self._gui.add_tab_group()
        return self._tabs.add_tab(name)

    def _bottom_tab(self, name: str) -> viser.GuiTabHandle:
        if self._bottom is not None:
            return self._bottom.add_tab(name)
        self._bottom = self._gui.add_panel()
        tab = self._bottom.add_tab(name)
        self._bottom.float(x=12, y=-ABOVE, width=BOTTOM_WIDTH)
        return tab
