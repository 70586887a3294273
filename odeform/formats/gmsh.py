"""Gmsh's .msh, versions 2 and 4.1, text or binary: the surface of its elements.

https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.budget import MEMORY, read_limited, require_memory
from odeform.errors import InputError
from odeform.formats.cells import Cells, surface
from odeform.formats.text import numbers_of, plain_text
from odeform.types import Floats, Geometry, Ints

__all__ = ["read_msh"]

BYTES_PER_BYTE = 12  # of memory while reading
NODES = {
    **{1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 6: 6, 7: 5, 8: 3, 9: 6, 10: 9, 11: 10, 12: 27, 13: 18, 14: 14, 15: 1, 16: 8},
    **{17: 20, 18: 15, 19: 13, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21, 26: 4, 27: 5, 28: 6, 29: 20, 30: 35},
    **{31: 56, 36: 16, 37: 25, 92: 64, 93: 125},
}
"""Nodes of each type of elements."""
KINDS = {
    **dict.fromkeys((2, 9, 20, 21, 22, 23, 24, 25), ("triangle", 3)),
    **dict.fromkeys((3, 10, 16, 36, 37), ("quad", 4)),
    **dict.fromkeys((4, 11, 29, 30, 31), ("tetrahedron", 4)),
    **dict.fromkeys((5, 12, 17, 92, 93), ("hexahedron", 8)),
    **dict.fromkeys((6, 13, 18), ("wedge", 6)),
    **dict.fromkeys((7, 14, 19), ("pyramid", 5)),
    15: ("vertex", 1),
}
FIRST_ORDER = (2, 3, 4, 5, 6, 7, 15)


@dataclass
class _Numbers:
    """Numbers of a section, one after the other: text or binary."""

    data: bytes | NDArray[np.float64]
    order: str
    where: str
    position: int = 0

    def take(self, count: int, kind: str) -> NDArray[Any]:
        """The next `count` numbers of a NumPy type. Raises `InputError` where the section ends before."""
        if isinstance(self.data, bytes):
            dtype = np.dtype(self.order + kind)
            size, room = count * dtype.itemsize, len(self.data) - self.position
        else:
            dtype, size, room = np.dtype(kind), count, len(self.data) - self.position
        if not 0 <= size <= room:
            raise InputError(f"{self.where}: expected {count:,} more numbers of a section, got fewer: truncated?")
        start, self.position = self.position, self.position + size
        if isinstance(self.data, bytes):
            return np.frombuffer(self.data, dtype, count, start)
        found = self.data[start : self.position]
        return found if dtype.kind == "f" else np.clip(np.nan_to_num(found), -(2.0**62), 2.0**62).astype(np.int64)


def read_msh(path: Path, merge: bool) -> Geometry:
    """Reads the surface of the solid elements, else the flat ones, else the nodes.

    Raises:
        InputError: For other versions, and for files that are cut short.
    """
    where, size = f"geometry {path}", path.stat().st_size
    require_memory(where, f"{size:,} bytes of .msh", BYTES_PER_BYTE * size)
    data = read_limited(path, where, MEMORY // 4)
    version, binary, order = _format(data, where)
    if not binary:
        data = plain_text(data)

    def section(name: bytes) -> _Numbers:
        start = data.find(b"$" + name)
        stop = data.find(b"$End" + name, start)
        if start < 0 or stop < 0:
            raise InputError(f"{where}: expected a section ${name.decode()} with its end: truncated?")
        start = data.find(b"\n", start) + 1
        if binary:
            return _Numbers(data[start:stop], order, where)
        first = data.count(b"\n", 0, start) + 1
        return _Numbers(numbers_of(data[start:stop], where, range(first, 1 << 40)), order, where)

    if version < 4:
        tags, points = _nodes_2(binary, section(b"Nodes"))
        cells = _elements_2(binary, section(b"Elements"))
    else:
        tags, points = _nodes_4(section(b"Nodes"))
        cells = _elements_4(section(b"Elements"))
    notes: list[str] = []
    groups = [Cells(kind, _indices(nodes, tags, where), counts, middle) for kind, nodes, counts, middle in cells]
    return surface(points, groups, where, notes)


Group = tuple[str, Ints, Ints, bool]


def _format(data: bytes, where: str) -> tuple[float, bool, str]:
    """Version, whether the file is binary, and its byte order."""
    head = data[:4096].replace(b"\r", b"")
    start = head.find(b"$MeshFormat")
    words = head[start:].split(b"\n", 2)
    try:
        version, binary, size = words[1].split()
        number = float(version)
    except (ValueError, IndexError):
        number, binary, size = 0.0, b"", b""
    if start < 0 or not (2.0 <= number < 3.0 or number == 4.1) or (binary == b"1" and size != b"8"):
        shown = words[1][:40].decode("latin-1") if start >= 0 and len(words) > 1 else head[:20].decode("latin-1")
        raise InputError(f"{where}: expected $MeshFormat of version 2 or 4.1, got {shown!r}")
    return number, binary == b"1", "<" if binary != b"1" or words[2][:4] == b"\x01\0\0\0" else ">"


def _indices(nodes: Ints, tags: Ints, where: str) -> Ints:
    """The places of nodes (M,) among the tags (N,)."""
    if len(tags) and np.array_equal(tags, np.arange(1, len(tags) + 1)):
        places = nodes - 1
        known = (places >= 0) & (places < len(tags))
    else:
        order = np.argsort(tags, kind="stable")
        places = np.searchsorted(tags[order], nodes)
        places = order[np.minimum(places, max(len(tags) - 1, 0))] if len(tags) else np.full(len(nodes), -1)
        known = tags[places] == nodes if len(tags) else np.zeros(len(nodes), bool)
    if not known.all():
        raise InputError(f"{where}: an element refers to node {nodes[np.argmin(known)]}, which does not exist")
    return places


def _line_count(numbers: _Numbers) -> int:
    """The number in the first line of a section of version 2, which is text in binary files too."""
    if not isinstance(numbers.data, bytes):
        return int(numbers.take(1, "i8")[0])
    stop = numbers.data.find(b"\n", 0, 64)
    word = numbers.data[: max(stop, 0)].strip()
    if not word.isdigit():
        raise InputError(f"{numbers.where}: expected a number of nodes or elements, got {word[:20]!r}")
    numbers.position = stop + 1
    return int(word)


def _nodes_2(binary: bool, numbers: _Numbers) -> tuple[Ints, Floats]:
    count = _line_count(numbers)
    if binary:
        row = np.dtype([("tag", numbers.order + "i4"), ("xyz", numbers.order + "f8", 3)])
        raw = numbers.take(count * row.itemsize, "u1")
        table = raw.view(row)
        return table["tag"].astype(np.int64), table["xyz"].astype(float)
    table = numbers.take(4 * count, "f8").reshape(-1, 4)
    return table[:, 0].astype(np.int64), table[:, 1:].copy()


def _elements_2(binary: bool, numbers: _Numbers) -> list[Group]:
    count = _line_count(numbers)
    found: dict[int, list[Ints]] = {}
    if binary:
        while count > 0:
            kind, number, tags = (int(value) for value in numbers.take(3, "i4"))
            width = 1 + tags + _width(kind, numbers)
            if number < 1 or tags < 0:
                raise InputError(f"{numbers.where}: expected elements of a type, got {number} with {tags} tags")
            rows = numbers.take(number * width, "i4").reshape(number, width)
            found.setdefault(kind, []).append(rows[:, 1 + tags :].astype(np.int64))
            count -= number
    else:
        flat, place = numbers.take(len(numbers.data) - numbers.position, "i8"), 0
        for _ in range(count):
            if place + 3 > len(flat):
                raise InputError(f"{numbers.where}: expected {count:,} elements, got fewer: truncated?")
            kind, tags = int(flat[place + 1]), int(flat[place + 2])
            start = place + 3 + tags
            place = start + _width(kind, numbers)
            if tags < 0 or place > len(flat):
                raise InputError(f"{numbers.where}: expected {count:,} elements, got fewer: truncated?")
            found.setdefault(kind, []).append(flat[start:place][None])
    return [_group(kind, np.concatenate(rows)) for kind, rows in found.items()]


def _nodes_4(numbers: _Numbers) -> tuple[Ints, Floats]:
    blocks, count, *_ = (int(value) for value in numbers.take(4, "u8"))
    tags, points = [], []
    for _ in range(blocks):
        dimension, _, parametric = (int(value) for value in numbers.take(3, "i4"))
        size = int(numbers.take(1, "u8")[0])
        width = 3 + (dimension if parametric else 0)
        if not 3 <= width <= 6:
            raise InputError(f"{numbers.where}: expected nodes of a dimension from 0 to 3, got {dimension}")
        tags.append(numbers.take(size, "u8").astype(np.int64))
        points.append(numbers.take(width * size, "f8").reshape(size, width)[:, :3])
    if not tags or sum(map(len, tags)) != count:
        raise InputError(f"{numbers.where}: expected {count:,} nodes, got {sum(map(len, tags)):,}: truncated?")
    return np.concatenate(tags), np.concatenate(points).astype(float)


def _elements_4(numbers: _Numbers) -> list[Group]:
    blocks, *_ = (int(value) for value in numbers.take(4, "u8"))
    groups = []
    for _ in range(blocks):
        _, _, kind = (int(value) for value in numbers.take(3, "i4"))
        size = int(numbers.take(1, "u8")[0])
        width = 1 + _width(kind, numbers)
        rows = numbers.take(width * size, "u8").reshape(size, width)
        groups.append(_group(kind, rows[:, 1:].astype(np.int64)))
    return groups


def _width(kind: int, numbers: _Numbers) -> int:
    if kind not in NODES:
        raise InputError(f"{numbers.where}: elements of type {kind} are not read")
    return NODES[kind]


def _group(kind: int, nodes: Ints) -> Group:
    name, size = KINDS.get(kind, ("", nodes.shape[1]))
    return name, nodes[:, :size].ravel(), np.full(len(nodes), size), kind not in FIRST_ORDER
