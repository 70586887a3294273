"""The seven objects, from their files or made anew."""

from functools import cache

from odeform.errors import InputError
from odeform.io import bundled
from odeform.simulation.objects.files import read_object
from odeform.simulation.objects.soft_object import SoftObject

__all__ = ["OBJECTS", "SHELLS", "get_object"]

OBJECTS = ("bottle", "cat", "dog", "donut", "chip", "flip-flop", "pillow")
SHELLS = ("chip",)
"""Those of triangles, which enclose nothing."""


@cache
def get_object(name: str) -> SoftObject:
    """Returns one of the seven objects, as bundled. Raises `InputError` for another name."""
    if name not in OBJECTS:
        raise InputError(f"object {name!r}: expected one of {', '.join(OBJECTS)}")
    return read_object(bundled("objects") / f"{name}.npz")
