"""Tells where the scene and the first model come from."""

from odeform_viz.columns import Column
from odeform_viz.page import Page, Panel

__all__ = ["AboutPanel"]


class AboutPanel(Panel):
    """Notes of the scene, its constants, and the commands that made the model."""

    def __init__(self, page: Page) -> None:
        with page.server.gui.add_folder("About", expand_by_default=False):
            page.server.gui.add_markdown(_about(page.model))


def _about(column: Column) -> str:
    assert column.predictor is not None
    provenance = column.predictor.checkpoint.provenance
    lines = list(column.source.schema.notes)
    if fixed := ", ".join(f"{name} {value:.4g}" for name, value in provenance.get("fixed", {}).items()):
        lines.append(f"Constant: {fixed}.")
    lines += [f"Made with `{command}`." for command in provenance.get("command", [])]
    return "\n\n".join(lines)
