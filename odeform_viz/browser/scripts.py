"""Holds what a page does without the server: keys, number boxes, the system's theme, clicks on plots."""

from importlib.resources import files
from typing import Literal

import viser
from viser._messages import RunJavascriptMessage

__all__ = ["SCRIPTS", "THEME_KEYS", "THEME_MODIFIER", "run_script", "run_scripts"]

SCRIPTS = ("keys", "numbers", "theme", "uploads", "plots", "phone", "view")
THEME_KEYS: dict[str, Literal["D", "L"]] = {"dark": "D", "light": "L"}
"""Hot keys of the commands that set the theme; `theme.js` presses them."""
THEME_MODIFIER = "alt+shift"


def run_scripts(server: viser.ViserServer) -> None:
    """Run the scripts in every client, now and when it connects; a client that connects again runs them once."""
    for name in SCRIPTS:
        source = (files("odeform_viz.browser") / f"{name}.js").read_text()
        run_script(server, _once(name, source))
    run_script(server, "window.odeform.followTheme()")


def run_script(to: viser.ViserServer | viser.ClientHandle, source: str) -> None:
    """Run a script in every client of a server, now and each time it connects, or in one client."""
    to.gui._websock_interface.queue_message(RunJavascriptMessage(source))


def _once(name: str, source: str) -> str:
    """A script that does nothing where it has run before."""
    return f"""
(window.odeform ??= {{}});
if (window.odeform[{name!r}]) return;
window.odeform[{name!r}] = true;
{source}
"""
