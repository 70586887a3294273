"""What each tab is for, and the hot keys."""

import threading
from collections.abc import Callable, Mapping

import viser

__all__ = ["HelpPanel", "help_text"]

TABS = {
    "Explore": "move the body's parameters; ticks and bands at a slider show where the model was trained",
    "Compare": "put models, pinned copies and the truth side by side; with truth, errors are painted and plotted",
    "Record": "take it away: a recording, the state of the page, the motion as a file",
}
MOUSE = "Drag turns the view, the right button moves it, the wheel zooms. Numbers beside sliders can be typed."


def help_text(keys: Mapping[str, str]) -> str:
    """Markdown; `keys` are the hot keys and what they do."""
    tabs = "  \n".join(f"**{name}**: {what}." for name, what in TABS.items())
    rows = " · ".join(f"**{key}** {what}" for key, what in keys.items())
    return f"{tabs}\n\n{MOUSE}\n\nKeys: {rows}"


class HelpPanel:
    """Hot keys, and the text that explains them: in a tab, and over the page of who presses its key."""

    KEY = "H"

    def __init__(self, server: viser.ViserServer, keys: Mapping[str, tuple[str, Callable[[], None]]]) -> None:
        """`keys` are hot keys, each with what it does in words and the doing; `H` is added."""
        for key, (label, action) in keys.items():
            command = server.gui.add_command(label.capitalize(), hotkey=key)  # pyright: ignore[reportArgumentType]
            command.on_trigger(lambda _, action=action: action())
        self._text = help_text({**{key: label for key, (label, _) in keys.items()}, self.KEY: "help"})
        server.gui.add_markdown(self._text)
        self._close: dict[int, Callable[[], None]] = {}
        """How to close what is open, by client."""
        self._lock = threading.Lock()
        server.gui.add_command("Help", hotkey=self.KEY).on_trigger(lambda event: self._toggle(event.client))
        server.on_client_disconnect(self._forget)

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
