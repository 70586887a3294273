"""The solid of a user's own body in a checkpoint, so that it can be simulated again."""

import json
from collections.abc import Mapping
from typing import Any

from odeform.simulation.objects.files import arrays_of, object_of
from odeform.simulation.objects.soft_object import SoftObject
from odeform.types import Arrays

__all__ = ["SOLID", "item_in", "parts_of_item"]

SOLID = "solid"
"""The key of its settings, and the start of the names of its arrays."""


def parts_of_item(item: SoftObject) -> tuple[Arrays, dict[str, Any]]:
    """Returns the arrays and the settings of a checkpoint that hold a soft object."""
    arrays = arrays_of(item)
    about = json.loads(str(arrays.pop("about")))
    return {f"{SOLID}.{name}": array for name, array in arrays.items()}, {SOLID: about}


def item_in(arrays: Arrays, config: Mapping[str, Any]) -> SoftObject | None:
    """The soft object of a checkpoint of one body; None where it has none. KeyError, ValueError or TypeError where
    something of it is missing or wrong."""
    if SOLID not in config:
        return None
    own = {key.removeprefix(f"{SOLID}."): array for key, array in arrays.items() if key.startswith(f"{SOLID}.")}
    return object_of({**own, "about": json.dumps(config[SOLID])})
