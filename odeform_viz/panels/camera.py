"""How the camera moves."""

from odeform_viz.page import Page, Panel
from odeform_viz.state import PageState

__all__ = ["CameraPanel"]


class CameraPanel(Panel):
    """Whether the first body stays in view."""

    def __init__(self, page: Page) -> None:
        with page.server.gui.add_folder("View"):
            self._follow = page.server.gui.add_checkbox(
                "follow the body", initial_value=True, hint="keeps the first column in view"
            )
        self._follow.on_update(lambda _: page.wake())
        page.controls.follow = lambda: bool(self._follow.value)

    def restore(self, state: PageState) -> None:
        self._follow.value = state.display.follow
