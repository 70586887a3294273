"""How bodies are drawn: what their colours show, how strongly they deform, and how the camera moves."""

from odeform_viz.page import Page, Panel
from odeform_viz.state import PageState
from odeform_viz.view import COLOR_BY, DisplayOptions

__all__ = ["MOST_EXAGGERATED", "CameraPanel"]

MOST_EXAGGERATED = 10.0


class CameraPanel(Panel):
    """Display options that do not depend on the columns."""

    def __init__(self, page: Page) -> None:
        gui = page.server.gui
        with gui.add_folder("View"):
            self._colors = gui.add_dropdown(
                "colour by",
                COLOR_BY,
                initial_value="error",
                hint="displacement and strain leave out the rigid motion; errors need a truth; overlaid columns have "
                "the colours of their curves",
            )
            self._exaggeration = gui.add_slider(
                "exaggerate",
                min=1.0,
                max=MOST_EXAGGERATED,
                step=0.5,
                initial_value=1.0,
                hint="factor of the deformation; the rigid motion stays as it is",
            )
            self._momentary = gui.add_checkbox(
                "scale of this moment", False, hint="colours fit each moment, instead of the whole motion"
            )
            self._ghost = gui.add_checkbox("ghost", False, hint="the shape at rest, in the same pose")
            self._wireframe = gui.add_checkbox("wireframe", False, hint="of meshes")
            self._follow = gui.add_checkbox("follow the body", True, hint="bodies stay in view, the floor moves")
            fit = gui.add_button("Fit the view", color="gray", hint="aim the camera as it was at first")
        controls = (self._colors, self._momentary, self._exaggeration, self._ghost, self._wireframe, self._follow)
        for control in controls:
            control.on_update(lambda _: page.wake())
        fit.on_click(lambda _: page.controls.fit_view())
        page.controls.drawing = self._options
        page.add_hotkey("C", "next colours", self._next_colors)
        page.add_hotkey("G", "ghost on or off", lambda: setattr(self._ghost, "value", not self._ghost.value))

    def restore(self, state: PageState) -> None:
        display = state.display
        self._colors.value, self._exaggeration.value = display.color_by, display.exaggeration
        self._ghost.value, self._wireframe.value = display.ghost, display.wireframe
        self._follow.value, self._momentary.value = display.follow, display.momentary

    def _options(self) -> DisplayOptions:
        exaggeration = float(self._exaggeration.value)
        return DisplayOptions(
            color_by=self._colors.value if self._colors.value in COLOR_BY else COLOR_BY[0],
            exaggeration=exaggeration if 1.0 <= exaggeration <= MOST_EXAGGERATED else 1.0,
            ghost=bool(self._ghost.value),
            wireframe=bool(self._wireframe.value),
            follow=bool(self._follow.value),
            momentary=bool(self._momentary.value),
        )

    def _next_colors(self) -> None:
        self._colors.value = COLOR_BY[(COLOR_BY.index(self._options().color_by) + 1) % len(COLOR_BY)]
