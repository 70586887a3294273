"""Accessors: arrays of numbers in the buffers, dense or sparse, whole or as fractions.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html, section 3.6.2.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.formats.gltf.document import Document, Tree

__all__ = ["read_accessor", "read_floats", "read_indices"]

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
ALIGNMENT = (
    4  # bytes, of the columns of matrices; only those of 2 and 3 small rows would be padded, and no one has them
)


def read_accessor(document: Document, index: object) -> NDArray[Any]:
    """(count, width) numbers as they are stored. Raises `InputError` for damage."""
    accessor = document.item("accessors", index)
    kind, dtype = str(accessor.get("type")), _dtype(document, accessor)
    if kind not in WIDTHS:
        raise InputError(
            f"{document.where}: accessor {index}: expected a type of {', '.join(WIDTHS)}, got {kind[:20]!r}"
        )
    count, width = document.number(accessor, "count"), WIDTHS[kind]
    if "bufferView" in accessor:
        out = _strided(document, accessor, count, width, dtype)
    else:
        out = np.zeros((count, width), dtype)
    sparse = accessor.get("sparse")
    return out if sparse is None else _replaced(document, out, sparse)


def read_floats(document: Document, index: object, width: int, count: int | None = None) -> NDArray[np.float64]:
    """(count, width) numbers; normalised integers become fractions. `InputError` for another width or count."""
    numbers = read_accessor(document, index)
    if numbers.shape[1] != width or (count is not None and len(numbers) != count):
        got = f"{len(numbers)} of {numbers.shape[1]}"
        raise InputError(
            f"{document.where}: accessor {index}: expected {'any number' if count is None else count} of {width} "
            f"components, got {got}"
        )
    values = numbers.astype(float)
    if document.item("accessors", index).get("normalized") and numbers.dtype.kind in "iu":
        values = np.maximum(values / np.iinfo(numbers.dtype).max, -1.0)
    return values


def read_indices(document: Document, index: object, count: int) -> NDArray[np.int64]:
    """Reads (M,) indices below `count`. `InputError` for anything else."""
    numbers = read_accessor(document, index)
    if numbers.shape[1] != 1 or numbers.dtype.kind not in "iu":
        raise InputError(f"{document.where}: accessor {index}: expected whole numbers as indices")
    flat = numbers[:, 0].astype(np.int64)
    if len(flat) and flat.max() >= count:
        raise InputError(f"{document.where}: accessor {index}: refers to vertex {flat.max()}, of {count}")
    return flat


def _dtype(document: Document, of: Tree) -> np.dtype[Any]:
    kind = of.get("componentType")
    if kind not in COMPONENTS:
        raise InputError(f"{document.where}: expected a componentType of {list(COMPONENTS)}, got {kind!r}")
    return np.dtype(COMPONENTS[kind])


def _strided(document: Document, accessor: Tree, count: int, width: int, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Numbers of a buffer view, in which elements of several accessors may alternate."""
    view = document.item("bufferViews", accessor["bufferView"])
    data, start = document.view(accessor["bufferView"]), document.number(accessor, "byteOffset", 0)
    size = width * dtype.itemsize
    stride = document.number(view, "byteStride", 0) or size
    need = start + stride * (count - 1) + size if count else 0
    if stride < size:
        raise InputError(f"{document.where}: expected a byteStride of at least {size} bytes an element, got {stride}")
    if need > len(data):
        raise InputError(
            f"{document.where}: accessor of {count:,} elements of {size} bytes: expected a buffer view of {need:,} "
            f"bytes, got {len(data):,}"
        )
    if not count:
        return np.zeros((0, width), dtype)
    return np.ndarray((count, width), dtype, data, start, (stride, dtype.itemsize)).copy()


def _replaced(document: Document, dense: NDArray[Any], sparse: object) -> NDArray[Any]:
    """The elements that a sparse accessor gives, in place of those of the dense part."""
    places, values = (sparse.get(name) if isinstance(sparse, dict) else None for name in ("indices", "values"))
    if not isinstance(sparse, dict) or not isinstance(places, dict) or not isinstance(values, dict):
        raise InputError(f"{document.where}: expected a sparse accessor with count, indices and values")
    count = document.number(sparse, "count")
    where = _strided(document, places, count, 1, _dtype(document, places))[:, 0]
    if where.dtype.kind not in "iu" or (count and int(where.max()) >= len(dense)):
        raise InputError(f"{document.where}: a sparse accessor: expected whole numbers below {len(dense)} as indices")
    dense[where] = _strided(document, values, count, dense.shape[1], dense.dtype)
    return dense
