"""The solid of a user's own body in a checkpoint, so that it can be simulated again, and the forces that suit it."""

import json
from collections.abc import Mapping
from typing import Any

from odeform.geometry.contact import nearest_on
from odeform.loads.kick import STRONGER
from odeform.loads.load import Load
from odeform.simulation.contacts import CONTACT, vector_of
from odeform.simulation.objects.files import arrays_of, object_of
from odeform.simulation.objects.materials import forces_at
from odeform.simulation.objects.soft_object import SoftObject
from odeform.types import Arrays, Mesh

__all__ = ["SOLID", "forces_in", "item_in", "parts_of_item"]

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


def forces_in(item: SoftObject, rest: Mesh, parameters: Mapping[str, Any], load: Load | None) -> tuple[float, float]:
    """Newton, weakest and strongest on a body that rests as `rest`: at the contact of `parameters`, if they have one,
    else the most anywhere. Under a load other than a push these are the peaks of a kick."""
    if f"{CONTACT}_x" in parameters:
        weakest, strongest = forces_at(item, nearest_on(rest, vector_of(parameters, CONTACT)))
    else:
        weakest, strongest = item.forces
    return (weakest, strongest) if load is None else (STRONGER * weakest, STRONGER * strongest)
