"""PLY files as tables of numbers, one per element. Meshes, whose faces are lists, are read by trimesh instead.

This is not plyfile, which is no faster and needs the whole file to tell whether it contains splats: the header alone
decides that here, also where it has comments that are not ASCII.

Greg Turk, "The PLY Polygon File Format" (1994).
"""

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.types import Floats

__all__ = ["Table", "columns", "ply_properties", "read_ply_tables"]

Table = NDArray[Any]
"""(rows,) structured array with one named column per property."""

MAX_HEADER = 1 << 20  # bytes
BLOCK = 8192  # rows at a time: a wide table is then read from memory once, not once per column
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "="}
TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}


def ply_properties(path: Path) -> set[str]:
    """Names of the properties of all elements; empty if this is not a PLY file."""
    lines, _ = _header(path)
    return {line[-1] for line in lines if line[0] == "property"}


def read_ply_tables(path: Path) -> dict[str, Table]:
    """Element -> table, up to the first element with lists; binary ones are memory-mapped.

    Raises `InputError` for an unknown format and for missing rows, `ValueError` or `KeyError` for other damage.
    """
    lines, start = _header(path)
    order = next((ORDERS[line[1]] for line in lines if line[0] == "format" and line[1] in ORDERS), None)
    if order is None:
        raise InputError(f"geometry {path}: expected a header with a format of {', '.join(ORDERS)}")
    tables: dict[str, Table] = {}
    with path.open("rb") as file:
        file.seek(start)
        for name, count, layout in _layouts(lines, order):
            if order == "=" and count:
                table = np.loadtxt(itertools.islice(file, count), dtype=layout, ndmin=1)
            else:
                table = _mapped(path, start, count, layout)
                start += count * layout.itemsize
            if len(table) < count:
                raise InputError(f"geometry {path}: expected {count} rows of {name}, got {len(table)}: truncated?")
            tables[name] = table
    return tables


def _layouts(lines: list[list[str]], order: str) -> Iterator[tuple[str, int, np.dtype[Any]]]:
    """Name, number of rows and dtype of each element up to the first one with lists."""
    starts = [index for index, line in enumerate(lines) if line[0] == "element"]
    for start, stop in itertools.pairwise([*starts, len(lines)]):
        properties = [line for line in lines[start:stop] if line[0] == "property"]
        if any(line[1] == "list" for line in properties):
            return
        layout = np.dtype([(name, order + TYPES[kind]) for _, kind, name in properties])
        yield lines[start][1], int(lines[start][2]), layout


def columns(table: Table, names: Sequence[str], path: Path) -> Floats:
    """(N, C) float32 for N rows and C names. Raises `InputError` if a column is missing."""
    missing = [name for name in names if name not in (table.dtype.names or ())]
    if missing:
        raise InputError(f"geometry {path}: splats without {', '.join(missing)}")
    out = np.empty((len(table), len(names)), np.float32)
    for start in range(0, len(table), BLOCK):
        rows = table[start : start + BLOCK]
        for column, name in enumerate(names):
            out[start : start + BLOCK, column] = rows[name]
    return out


def _mapped(path: Path, start: int, count: int, layout: np.dtype[Any]) -> Table:
    """Up to `count` rows, as many as the file has."""
    present = min(count, max(path.stat().st_size - start, 0) // max(layout.itemsize, 1))
    if present <= 0:
        return np.zeros(0, layout)
    return np.memmap(path, dtype=layout, mode="r", offset=start, shape=(present,))


def _header(path: Path) -> tuple[list[list[str]], int]:
    """The words of each header line, and the offset of the data in bytes."""
    with path.open("rb") as file:
        head = file.read(MAX_HEADER)
    text, end, rest = head.partition(b"end_header")
    if not head.startswith(b"ply") or not end:
        return [], 0
    newline = 2 if rest.startswith(b"\r\n") else 1
    lines = [line.split() for line in text.decode("latin-1").splitlines()]
    return [line for line in lines if line], len(text) + len(end) + newline
