"""Explains what each tab is for, and the hot keys."""

import threading
from collections.abc import Callable, Mapping

import viser

from odeform_viz.page import Page, Panel

__all__ = ["HelpPanel", "help_text"]

WHAT = """**ODeform** predicts how a soft body moves and deforms, for parameters and moments that you choose, while you
drag a slider, with models learned from simulations. It is an independent implementation of *ODeform: Learning
Continuous 4D Motion for Shape Deformation with Neural ODEs* by Velikova, Saleh, Kuang and Busam
([arXiv:2607.20670](https://arxiv.org/abs/2607.20670)), with models of its own.

**The badge** says whether this moment and these parameters are *inside* what the model was trained on
(green), outside of it or of a kind that was not trained (amber), or *not modelled* (red). The error beside it
is measured on sequences that were not used for training: nine of ten had a smaller one. With *no error estimate*
the laws of elasticity and contact move the body, and no error is known for what is in view.

**Every error is a distance**: how far each point of the body is from where a simulation, the *truth*, has it.
*RMS* is the root of the mean of its square over all points; colours show it point by point. The *solver error*
is the part of it that comes from the steps of the ODE solver.
"""
TABS = {
    "Explore": "change the parameters; marks at each slider show where the model was trained",
    "Compare": "show models, pinned copies and the truth side by side; with a truth, errors are coloured and plotted",
    "View": "what colours show, exaggeration, and how each column was computed",
    "Record": "save a recording, the state of the page, or the motion as a file",
}
KEY_NAMES = {"space": "Space", "arrowleft": "←", "arrowright": "→"}
MOUSE = "Drag to rotate, right-drag to pan, scroll to zoom. You can also type numbers beside the sliders."


def help_text(hotkeys: Mapping[str, str]) -> str:
    """Markdown; `hotkeys` are keys and what they do."""
    tabs = "  \n".join(f"**{name}**: {what}." for name, what in TABS.items())
    keys = " · ".join(f"{_named(key)} {what}" for key, what in hotkeys.items())
    return f"{WHAT}\n\n{tabs}\n\n{MOUSE}\n\nKeys: {keys}"


def _named(keys: str) -> str:
    return " or ".join(f"**{KEY_NAMES.get(key, key)}**" for key in keys.split())


class HelpPanel(Panel):
    """The help text in a tab, and in a dialog for the client that presses `H`."""

    KEY = "H"

    def __init__(self, page: Page) -> None:
        gui = page.server.gui
        self._text = help_text({**page.hotkeys, self.KEY: "help"})
        gui.add_markdown(self._text)
        self._close: dict[int, Callable[[], None]] = {}
        """Closes the open dialog of a client."""
        self._lock = threading.Lock()
        gui.add_command("Help", hotkey=self.KEY).on_trigger(lambda event: self._toggle(event.client))
        page.server.on_client_disconnect(self._forget)

    def _forget(self, client: viser.ClientHandle) -> None:
        self._close.pop(client.client_id, None)

    def _toggle(self, client: viser.ClientHandle | None) -> None:
        if client is None:
            return
        with self._lock:
            if client.client_id in self._close:
                self._close.pop(client.client_id)()
                return
            modal = client.gui.add_modal("Help")
            self._close[client.client_id] = modal.close
            with modal:
                client.gui.add_markdown(self._text)
                client.gui.add_button("Close", color="gray").on_click(lambda _: self._toggle(client))
