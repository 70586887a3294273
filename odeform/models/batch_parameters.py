"""Parameters of many motions, from arrays."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.schema import OBJECT, Schema

__all__ = ["parameter_sets"]


def parameter_sets(
    schema: Schema,
    given: Mapping[str, Any],
    complete: Callable[[Mapping[str, Any]], dict[str, Any]],
) -> list[dict[str, Any]]:
    """All parameters of each of B motions. `complete` does one motion's.

    Values by name are arrays (B,), (B, 3) for a vector, or a number, vector or name that all motions share.

    Raises:
        InputError: no arrays, arrays that are empty or of different lengths or of other shapes, an unknown name, or a
            value that is not acceptable: with the index of its motion.
    """
    arrays = {name: array for name, value in given.items() if (array := _each(schema, name, value)) is not None}
    lengths = {name: len(array) for name, array in arrays.items()}
    if not lengths:
        raise InputError("batch: expected at least one parameter as an array (B,), got none")
    if len(set(lengths.values())) > 1:
        found = ", ".join(f"{length} of {name}" for name, length in lengths.items())
        raise InputError(f"batch: expected arrays of one length, got {found}")
    count = next(iter(lengths.values()))
    if not count:
        raise InputError(f"batch: expected at least one motion, got an empty array of {', '.join(arrays)}")
    shared = {name: value for name, value in given.items() if name not in arrays}
    rows = {name: array.tolist() for name, array in arrays.items()}
    sets = []
    for index in range(count):
        try:
            sets.append(complete(shared | {name: row[index] for name, row in rows.items()}))
        except InputError as error:
            raise InputError(f"motion {index} of {count}: {error}") from None
    return sets


def _each(schema: Schema, name: str, value: Any) -> np.ndarray | None:
    """(B,) or (B, 3): the values of all motions; None for one that they share."""
    if isinstance(value, str):
        return None
    if name == OBJECT:
        raise InputError(f"object: expected one name that all motions share, got {value!r}")
    vector = name not in schema.names and {f"{name}_{axis}" for axis in "xyz"} <= set(schema.names)
    shape = "(B, 3)" if vector else "(B,)"
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError, RuntimeError):
        raise InputError(f"{name}: expected numbers, or an array {shape} of them, got {value!r}") from None
    if array.ndim == int(vector) and (not vector or array.shape == (3,)):
        return None
    if array.ndim != 1 + int(vector) or (vector and array.shape[1] != 3):
        one = "three numbers" if vector else "a number"
        raise InputError(f"{name}: expected {one}, or an array {shape}, got shape {array.shape}")
    return array
