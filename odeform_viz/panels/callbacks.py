"""Controls that the viewer itself sets too: telling its hand from the user's, and one hand from the next."""

import threading
from collections.abc import Callable

import viser

__all__ = ["LOCK", "on_user_change", "serialized"]

Control = viser.GuiDropdownHandle | viser.GuiCheckboxHandle | viser.GuiSliderHandle | viser.GuiNumberHandle
Controls = Control | viser.GuiVector3Handle

LOCK = threading.RLock()
"""Callbacks run side by side; those that build on what is there take turns, and then read the newest values."""


def serialized(action: Callable[[], None]) -> Callable[[object], None]:
    """A callback, of a button or the like, that waits for its turn."""

    def called(_: object) -> None:
        with LOCK:
            action()

    return called


def on_user_change(control: Controls, action: Callable[[], None]) -> None:
    """Call `action` in turn when a user changes a control, not when the viewer does."""

    def changed(event: viser.GuiEvent) -> None:
        if event.client_id is not None:
            serialized(action)(event)

    control.on_update(changed)
