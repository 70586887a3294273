"""Commands that installed packages declare, by entry points in the group `odeform.commands`: a name, and a module."""

from importlib.metadata import entry_points
from importlib.util import find_spec
from typing import Any

from odeform.errors import InputError

__all__ = ["declared_commands", "refuse_absent"]

GROUP = "odeform.commands"


def declared_commands() -> dict[str, Any]:
    """Load the modules of those commands whose packages are installed here; by name."""
    found = sorted(entry_points(group=GROUP), key=lambda entry: entry.name)
    return {entry.name: entry.load() for entry in found if find_spec(_package(entry.module))}


def refuse_absent(name: str) -> None:
    """Raise `InputError` if a command of this name is declared, but its package is not installed here."""
    for entry in entry_points(group=GROUP, name=name):
        if not find_spec(_package(entry.module)):
            raise InputError(
                f"odeform {name}: it makes figures of the documentation, and needs a clone of the repository, "
                f"installed by `pip install -e .`; {_package(entry.module)} is not in this installation"
            )


def _package(module: str) -> str:
    return module.partition(".")[0]
