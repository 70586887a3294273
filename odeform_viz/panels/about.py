"""Tells where the scene and the first model come from."""

import re

from odeform.loads.registry import load_of_scene
from odeform.models.names import ALIASES
from odeform_viz.columns import Column
from odeform_viz.page import Page, Panel
from odeform_viz.words import constant_text, notes_of

__all__ = ["AboutPanel"]


class AboutPanel(Panel):
    """Notes of the scene, its constants, and the commands that made the model."""

    def __init__(self, page: Page) -> None:
        with page.server.gui.add_folder("About", expand_by_default=False):
            page.server.gui.add_markdown(_about(page.model))


def _about(column: Column) -> str:
    assert column.predictor is not None
    provenance = column.predictor.checkpoint.provenance
    schema = column.source.schema
    lines = list(notes_of(schema))
    # under a load those of the scene that the model was trained in say nothing
    constants = {} if load_of_scene(schema.scene) is not None else provenance.get("fixed", {})
    if fixed := ", ".join(constant_text(name, value) for name, value in constants.items()):
        lines.append(f"Constant: {fixed}.")
    lines += [f"Made with `{_current(command)}`." for command in provenance.get("command", [])]
    return "\n\n".join(lines)


def _current(command: str) -> str:
    """The command with today's name of a family of models."""
    for older, name in ALIASES.items():
        if older != "odeform":  # still the family that suits the data
            command = re.sub(rf"--model {older}(?!\S)", f"--model {name}", command)
    return command
