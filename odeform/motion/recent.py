"""Small caches: of the values that were used last, and of those in use."""

import zlib
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar
from weakref import WeakValueDictionary

import numpy as np

from odeform.types import Geometry

__all__ = ["InUse", "Recent", "geometry_key"]

Value = TypeVar("Value")


def geometry_key(geometry: Geometry) -> Hashable:
    """Identify a geometry and its points (N, 3) as they are now: a program may change them in place.

    A value that is kept under this key has to hold the geometry, so that its id stays its own.
    """
    return id(geometry), zlib.crc32(np.ascontiguousarray(geometry.points).data)


class Recent(Generic[Value]):
    """Keeps the last `size` values by key. Threads may share it: its entries are replaced, never changed."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._entries: tuple[tuple[Hashable, Value], ...] = ()

    @property
    def values(self) -> tuple[Value, ...]:
        """Those that are kept, the last one first."""
        return tuple(value for _, value in self._entries)

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """The value of `key`, which is made if it is not kept."""
        entries = self._entries
        found = next((entry for entry in entries if entry[0] == key), None)
        if found is None:
            found = (key, make())
        if not entries or found is not entries[0]:
            self._entries = (found, *(entry for entry in entries if entry is not found))[: self._size]
        return found[1]


class InUse(Generic[Value]):
    """Keeps the value that was asked for last, and others as long as something else refers to them."""

    def __init__(self) -> None:
        self._referred: WeakValueDictionary[Hashable, Value] = WeakValueDictionary()
        self._last: Value | None = None

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """The value of `key`, which is made if it is not kept."""
        value = self._referred.get(key)
        if value is None:
            value = self._referred[key] = make()
        self._last = value
        return value
