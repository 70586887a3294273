"""A panel as an extension would bring it."""

from odeform_viz.page import Page, Panel
from odeform_viz.state import PageState
from odeform_viz.view import Description

__all__ = ["ToyPanel", "UnneededPanel"]


class ToyPanel(Panel):
    """Says how fast the first body is, and counts its calls."""

    def __init__(self, page: Page) -> None:
        self.calls: list[str] = []
        self._text = page.server.gui.add_markdown("no frame yet")
        page.add_hotkey("T", "say hello", lambda: self.calls.append("hotkey"))

    def describe(self, description: Description) -> None:
        self._text.content = f"toy: {description.frame.columns[0].pose[0, 3]:.3f} m"

    def show_error(self, message: str) -> None:
        self.calls.append(message)

    def restore(self, state: PageState) -> None:
        self.calls.append(f"restore {state.time}")

    def close(self) -> None:
        self.calls.append("close")


class UnneededPanel(ToyPanel):
    """No page needs it."""

    @classmethod
    def needed(cls, page: Page) -> bool:
        return False
