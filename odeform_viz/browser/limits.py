"""The ranges of number boxes that have no slider beside them."""

import viser

from odeform_viz.browser.scripts import run_script

__all__ = ["set_limits"]


def set_limits(
    server: viser.ViserServer, control: viser.GuiNumberHandle | viser.GuiVector3Handle, low: float, high: float
) -> None:
    """Refuse in words what is typed outside of `low` to `high`; viser's own limits would move it silently."""
    run_script(server, f"((window.odeform ??= {{}}).limits ??= {{}})['{control._impl.uuid}'] = [{low!r}, {high!r}]")
