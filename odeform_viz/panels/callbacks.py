"""Controls that both the user and the viewer set: who changed one, and one callback at a time."""

import threading
from collections.abc import Callable

import viser

__all__ = ["LOCK", "on_user_change", "serialized", "set_content"]

Control = viser.GuiDropdownHandle | viser.GuiCheckboxHandle | viser.GuiSliderHandle | viser.GuiNumberHandle
Controls = Control | viser.GuiVector3Handle

LOCK = threading.RLock()
"""viser runs callbacks in parallel. Those that read and then change shared state hold this lock meanwhile."""


def serialized(action: Callable[[], None]) -> Callable[[object], None]:
    """A callback, of a button for instance, that runs `action` under `LOCK`."""

    def called(_: object) -> None:
        with LOCK:
            action()

    return called


def on_user_change(control: Controls, action: Callable[[], None]) -> None:
    """Call `action` under `LOCK` when a user changes a control, not when the viewer does."""

    def changed(event: viser.GuiEvent) -> None:
        if event.client_id is not None:
            serialized(action)(event)

    control.on_update(changed)


def set_content(text: viser.GuiMarkdownHandle | viser.GuiHtmlHandle, content: str) -> None:
    """Replace a text; nothing is sent if it is the same."""
    if text.content != content:
        text.content = content
