"""The material of a shape of the user's own: by name, or by numbers."""

from collections.abc import Callable

from odeform.simulation.objects.materials import CHOICE, material_of
from odeform_viz.page import Page
from odeform_viz.panels.callbacks import on_user_change, serialized

__all__ = ["MaterialChoice"]

AUTOMATIC, NUMBERS = "softest that stands", "own numbers"
HINT = "what the shape is made of; at first the softest material of the list with which it stands"
YOUNG, DENSITY = 60.0, 120.0  # kPa and kg/m^3 that numbers begin with: those of foam


class MaterialChoice:
    """A list of materials, with two numbers for others."""

    def __init__(self, page: Page, changed: Callable[[], None]) -> None:
        """Add the controls to the page's; `changed` is called where a shape is to be made of another material."""
        gui = page.server.gui
        self._name = gui.add_dropdown("material", (AUTOMATIC, *CHOICE, NUMBERS), hint=HINT)
        self._young = gui.add_number("stiffness, kPa", YOUNG, min=0.1, max=1e5, visible=False, hint="Young's modulus")
        self._density = gui.add_number("density, kg/m³", DENSITY, min=1.0, max=2e4, visible=False)
        self._source = gui.add_markdown("", visible=False)
        self._use = gui.add_button("Use these numbers", color="gray", visible=False)
        on_user_change(self._name, lambda: self._chosen(changed))
        self._use.on_click(serialized(changed))

    def value(self) -> str | None:
        """The material as `odeform.simulation.objects.materials.material_of` reads it; None for the automatic one.

        `InputError` for a value that no control can have.
        """
        if self._name.value == AUTOMATIC:
            return None
        name = f"{self._young.value:g}:{self._density.value:g}" if self._name.value == NUMBERS else self._name.value
        material_of(name)
        return name

    def set(self, name: str | None) -> None:
        """Show what `value` once returned; the shape is not made again."""
        self._name.value = AUTOMATIC if name is None else name if name in CHOICE else NUMBERS
        if self._name.value == NUMBERS:
            given = material_of(str(name))
            self._young.value, self._density.value = 1e-3 * given.young, given.density
        self._show()

    def _chosen(self, changed: Callable[[], None]) -> None:
        self._show()
        if self._name.value != NUMBERS:
            changed()

    def _show(self) -> None:
        numbers, known = self._name.value == NUMBERS, CHOICE.get(self._name.value)
        self._young.visible = self._density.visible = self._use.visible = numbers
        self._source.content = f"*{known.source}*" if known else ""
        self._source.visible = known is not None
