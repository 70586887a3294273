"""PLY files as tables of numbers, one per element, with lists of any length.

This is not plyfile, which is no faster and needs the whole file to tell whether it contains splats: the header alone
decides that here, also where it has comments that are not ASCII.

Greg Turk, "The PLY Polygon File Format" (1994).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.types import Floats

__all__ = ["Element", "Header", "Property", "Table", "columns", "read_header"]

Table = NDArray[Any]
"""(rows,) structured array with one named column per property."""

USUAL_HEADER, MAX_HEADER = 1 << 13, 1 << 20  # bytes
MOST_BLANKS = 80  # behind end_header
BLOCK = 8192  # rows at a time: a wide table is then read from memory once, not once per column
BOM = b"\xef\xbb\xbf"
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "="}
TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8", "int64": "i8", "uint64": "u8"},
}


@dataclass(frozen=True)
class Property:
    """A column of an element: numbers of a NumPy type, or with `count` lists of them, whose lengths are of that one."""

    name: str
    kind: str
    count: str = ""


@dataclass(frozen=True)
class Element:
    """`rows` rows of some properties."""

    name: str
    rows: int
    properties: tuple[Property, ...]

    @property
    def lists(self) -> bool:
        """Whether rows differ in length."""
        return any(entry.count for entry in self.properties)


@dataclass(frozen=True)
class Header:
    """Holds what a file says of itself.

    Attributes:
        order: "<" or ">" for binary data, "=" for text.
        elements: In the order of the data.
        textures: Names of image files, from comments.
        start: Where the data begins, in bytes.
        lines: How many lines the header has.
    """

    order: str
    elements: tuple[Element, ...]
    textures: tuple[str, ...]
    start: int
    lines: int


def read_header(path: Path) -> Header:
    """The header of a file. Raises `InputError` where it is missing or damaged."""
    where, order, textures, elements = f"geometry {path}", "", [], []
    lines, start = _header(path, where)
    properties: list[Property] = []
    for number, line in enumerate(lines, 1):
        match line.split():
            case ["format", kind, *_] if kind in ORDERS:
                order = ORDERS[kind]
            case ["comment", word, *rest] if word.lower() == "texturefile":
                textures.append(line.split(None, 2)[2].strip() if rest else "")
            case ["element", name, rows, *_] if rows.isascii() and rows.isdigit() and len(rows) < 16:
                properties = []
                elements.append((name, int(rows), properties))
            case ["property", "list", count, kind, name] if (
                elements and kind in TYPES and TYPES.get(count, "f")[0] != "f"
            ):
                properties.append(Property(name, TYPES[kind], TYPES[count]))
            case ["property", kind, name] if elements and kind in TYPES:
                properties.append(Property(name, TYPES[kind]))
            case ["element" | "property", *_]:
                raise InputError(f"{where}: line {number}: expected a line of a PLY header, got {line.strip()[:60]!r}")
            case _:  # comments, some of which go on without their keyword
                pass
    if not order:
        raise InputError(f"{where}: expected a header with a format of {', '.join(ORDERS)}")
    made = tuple(Element(name, rows, tuple(entries)) for name, rows, entries in elements)
    for element in made:
        names = [entry.name for entry in element.properties]
        if len(set(names)) < len(names):
            raise InputError(f"{where}: element {element.name}: two properties of one name")
    return Header(order, made, tuple(textures), start, len(lines))


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


def _header(path: Path, where: str) -> tuple[list[str], int]:
    """The lines of the header, and the offset of the data in bytes."""
    with path.open("rb") as file:
        head = file.read(USUAL_HEADER)
        if b"end_header" not in head[:-MOST_BLANKS]:
            head += file.read(MAX_HEADER)
    bom = len(BOM) if head.startswith(BOM) else 0
    text, end, rest = head[bom:].partition(b"end_header")
    if not text.startswith(b"ply"):
        raise InputError(f"{where}: expected ply in the first line, got {text[:20]!r}: not a PLY file?")
    if not end:
        raise InputError(f"{where}: expected a header that ends in end_header, got {len(head):,} bytes: truncated?")
    # "\n" after a lone "\r" is data already
    alone = b"\r" in text and b"\n" not in text
    newline = rest.find(b"\r" if alone else b"\n", 0, MOST_BLANKS) + 1
    start = bom + len(text) + len(end) + newline
    return [*text.decode("latin-1").splitlines(), "end_header"], start
