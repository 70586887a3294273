"""PLY files of plain numbers: every element a table. Meshes, whose faces are lists, are trimesh's business.

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
"""(rows,), structured: a named column for each property."""

LONGEST = 1 << 20  # bytes of a header
BLOCK = 8192  # rows read at a time: a wide table then passes the memory once, not once a column
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "="}
TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}


def ply_properties(path: Path) -> set[str]:
    """Names of all properties, of whatever element; none if this is no PLY file."""
    lines, _ = _header(path)
    return {line[-1] for line in lines if line[0] == "property"}


def read_ply_tables(path: Path) -> dict[str, Table]:
    """Element -> its table, up to the first one with lists; binary ones are mapped, not loaded."""
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
                raise InputError(f"geometry {path}: expected {count} rows of {name}, got {len(table)}: cut short?")
            tables[name] = table
    return tables


def _layouts(lines: list[list[str]], order: str) -> Iterator[tuple[str, int, np.dtype[Any]]]:
    """Name, rows and columns of each element up to the first one with lists."""
    starts = [index for index, line in enumerate(lines) if line[0] == "element"]
    for start, stop in itertools.pairwise([*starts, len(lines)]):
        properties = [line for line in lines[start:stop] if line[0] == "property"]
        if any(line[1] == "list" for line in properties):
            return
        layout = np.dtype([(name, order + TYPES[kind]) for _, kind, name in properties])
        yield lines[start][1], int(lines[start][2]), layout


def columns(table: Table, names: Sequence[str], path: Path) -> Floats:
    """(rows, len(names)) float32. Raises `InputError` where the file lacks one."""
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
    """As many of the rows as the file has."""
    present = min(count, max(path.stat().st_size - start, 0) // max(layout.itemsize, 1))
    if present <= 0:
        return np.zeros(0, layout)
    return np.memmap(path, dtype=layout, mode="r", offset=start, shape=(present,))


def _header(path: Path) -> tuple[list[list[str]], int]:
    """The words of each line, and where the data start."""
    with path.open("rb") as file:
        head = file.read(LONGEST)
    text, end, rest = head.partition(b"end_header")
    if not head.startswith(b"ply") or not end:
        return [], 0
    newline = 2 if rest.startswith(b"\r\n") else 1
    lines = [line.split() for line in text.decode("latin-1").splitlines()]
    return [line for line in lines if line], len(text) + len(end) + newline
