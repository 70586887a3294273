"""The theme of the page, for each client alone: that of its system, or the one it chooses."""

import viser

from odeform_viz.browser.scripts import THEME_KEYS, THEME_MODIFIER
from odeform_viz.page import Page, Panel
from odeform_viz.rendering.stage import set_floor_theme
from odeform_viz.runtime.server import set_theme

__all__ = ["ThemePanel"]


class ThemePanel(Panel):
    """Two commands without controls; the page of a client triggers the one of its system, by its hot key."""

    def __init__(self, page: Page) -> None:
        for theme, key in THEME_KEYS.items():
            command = page.server.gui.add_command(f"{theme.capitalize()} theme", hotkey=key, modifier=THEME_MODIFIER)
            command.on_trigger(lambda event, theme=theme: _apply(event.client, theme))


def _apply(client: viser.ClientHandle | None, theme: str) -> None:
    if client is not None:
        set_theme(client.gui, dark=theme == "dark")
        set_floor_theme(client, dark=theme == "dark")
