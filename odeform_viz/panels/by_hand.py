"""Controls that the viewer itself sets too: telling its hand from the user's."""

from collections.abc import Callable

import viser

__all__ = ["on_hand"]

Control = viser.GuiDropdownHandle | viser.GuiCheckboxHandle | viser.GuiSliderHandle | viser.GuiNumberHandle
Controls = Control | viser.GuiVector3Handle


def on_hand(control: Controls, action: Callable[[], None]) -> None:
    """Call `action` when a user changes a control, not when the viewer does."""

    def changed(event: viser.GuiEvent) -> None:
        if event.client_id is not None:
            action()

    control.on_update(changed)
