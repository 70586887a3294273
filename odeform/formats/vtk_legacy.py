"""VTK's legacy format, `.vtk`: POLYDATA, UNSTRUCTURED_GRID and STRUCTURED_GRID of versions 1 to 5, as text or binary.

Kitware, "VTK File Formats", https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.formats.vtk_grid import POLYGON, STRIP, Grid
from odeform.types import Floats, Ints

__all__ = ["read_legacy"]

TYPES = {
    **{"bit": "u1", "char": "i1", "unsigned_char": "u1", "short": "i2", "unsigned_short": "u2", "int": "i4"},
    **{"unsigned_int": "u4", "long": "i8", "unsigned_long": "u8", "vtktypeint64": "i8", "vtkidtype": "i4"},
    **{"float": "f4", "double": "f8", "vtktypeint32": "i4", "vtktypeuint8": "u1"},
}
KINDS = {"vertices": 2, "lines": 4, "polygons": POLYGON, "triangle_strips": STRIP}
"""The sections of POLYDATA, and the type of their cells."""
WITHOUT_CELLS = ("structured_points", "rectilinear_grid", "field")
HEXAHEDRON, QUAD = 12, 9
LONGEST = 256  # characters of a keyword


class _Reader:
    """The part of the file that is not read yet."""

    def __init__(self, data: bytes, where: str) -> None:
        self.size, self.where, self.binary = len(data), where, False
        self.rest = data

    def line(self) -> list[str]:
        """The words of the next line that is not blank; none at the end."""
        while self.rest:
            line, _, self.rest = self.rest.partition(b"\n")
            if words := line[:4096].decode("latin-1").split():
                return words
        return []

    def count(self, word: str) -> int:
        if not word.isdecimal() or int(word) > self.size:
            raise self.error(f"expected a number of at most {self.size:,}, got {word[:LONGEST]!r}")
        return int(word)

    def numbers(self, count: int, kind: str) -> NDArray[Any]:
        """The next `count` numbers of the type `kind`."""
        if kind.lower() not in TYPES:
            raise self.error(f"expected a type of numbers such as float, got {kind[:LONGEST]!r}")
        dtype = np.dtype(TYPES[kind.lower()])
        if self.binary:
            length = -(-count // 8) if kind.lower() == "bit" else count * dtype.itemsize
            if length > len(self.rest):
                raise self.error(f"expected {length:,} bytes of {kind}, got {len(self.rest):,}: truncated?")
            found = np.frombuffer(self.rest[:length], dtype.newbyteorder(">")).astype(dtype)
            self.rest = self.rest[length:]
            return found
        words = self.rest.split(None, count)
        if len(words) < count:
            raise self.error(f"expected {count:,} numbers, got {len(words):,}: truncated?")
        self.rest = words.pop() if len(words) > count else b""
        try:
            return np.array(words, dtype=bytes).astype(float if dtype.kind == "f" else np.int64)
        except (ValueError, OverflowError):
            word = next(filter(_no_number, words), b"")[:40].decode("latin-1")
            raise self.error(f"expected numbers, got {word!r}") from None

    def error(self, text: str) -> InputError:
        return InputError(f"{self.where}: byte {self.size - len(self.rest):,}: {text}")


def read_legacy(data: bytes, where: str) -> Grid:
    """The data set in the bytes of a `.vtk` file. Raises `InputError`, which `where` leads, with the byte."""
    reader = _Reader(data, where)
    version = reader.line()
    if version[:3] != ["#", "vtk", "DataFile"]:
        raise InputError(f"{where}: expected '# vtk DataFile' in the first line, got {' '.join(version)[:60]!r}")
    _, _, reader.rest = reader.rest.partition(b"\n")  # the title
    encoding = [word.upper() for word in reader.line()]
    if encoding not in (["ASCII"], ["BINARY"]):
        raise reader.error(f"expected ASCII or BINARY in the third line, got {' '.join(encoding)[:60]!r}")
    reader.binary = encoding == ["BINARY"]
    parts = _Parts()
    while words := reader.line():
        _section(reader, [word.lower() for word in words], words, parts)
    return parts.grid(reader)


class _Parts:
    """Holds what was found so far."""

    def __init__(self) -> None:
        self.points: Floats | None = None
        self.dimensions: tuple[int, ...] = ()
        self.types: Ints | None = None
        self.cells: list[tuple[Ints, Ints, int]] = []  # offsets, connectivity, type or 0
        self.at_points, self.count = False, 0
        self.vectors: dict[str, Floats] = {}

    def grid(self, reader: _Reader) -> Grid:
        if self.points is None:
            raise reader.error("expected POINTS, got none")
        if self.dimensions:
            return _structured(self.points, self.dimensions, reader)
        if self.types is None and any(not kind for _, _, kind in self.cells):
            raise reader.error("expected CELL_TYPES behind CELLS, got none: truncated?")
        offsets: list[Ints] = [np.zeros(1, np.int64)]
        start = 0
        for own, connectivity, _ in self.cells:
            offsets.append(own[1:] + start)
            start += len(connectivity)
        types = [np.full(len(own) - 1, kind) for own, _, kind in self.cells]
        if self.types is not None:
            types = [self.types]
        joined = np.concatenate([np.zeros(0, np.int64), *(cells for _, cells, _ in self.cells)])
        kinds = np.concatenate([np.zeros(0, np.int64), *types])
        return Grid(self.points, joined, np.concatenate(offsets), kinds, self.vectors)


def _section(reader: _Reader, words: list[str], written: list[str], parts: _Parts) -> None:
    """Read what follows a line that starts with a keyword."""
    key = words[0]
    if key == "dataset":
        if words[1:2] and words[1] in WITHOUT_CELLS:
            raise reader.error(f"{written[1]} has no mesh: extract a surface first, in ParaView by Contour")
    elif key == "points":
        count, kind = _arguments(reader, words, 2)
        parts.points = reader.numbers(3 * reader.count(count), kind).reshape(-1, 3)
    elif key == "dimensions":
        parts.dimensions = tuple(map(reader.count, _arguments(reader, words, 3)))
    elif key in KINDS or key == "cells":
        parts.cells.append((*_cells(reader, words), KINDS.get(key, 0)))
    elif key == "cell_types":
        parts.types = reader.numbers(reader.count(_arguments(reader, words, 1)[0]), "int").astype(np.int64)
    elif key in ("point_data", "cell_data"):
        parts.at_points, parts.count = key == "point_data", reader.count(_arguments(reader, words, 1)[0])
    elif key in ATTRIBUTES:
        ATTRIBUTES[key](reader, words, written, parts)
    elif key == "metadata":
        block, blank, rest = reader.rest.partition(b"\n\n")
        reader.rest = rest if blank else b"" if block else rest
    else:
        raise reader.error(f"expected a keyword of VTK such as POINTS or CELLS, got {written[0][:60]!r}")


def _arguments(reader: _Reader, words: list[str], count: int) -> list[str]:
    if len(words) < count + 1:
        raise reader.error(f"expected {count} words behind {words[0].upper()}, got {len(words) - 1}")
    return words[1 : count + 1]


def _cells(reader: _Reader, words: list[str]) -> tuple[Ints, Ints]:
    """Offsets and connectivity: either both as arrays (version 5.1), or each cell behind its number of points."""
    first, second = map(reader.count, _arguments(reader, words, 2))
    before = reader.rest
    following = reader.line()
    if following[:1] and following[0].upper() == "OFFSETS":
        offsets = reader.numbers(first, following[-1]).astype(np.int64)
        following = reader.line()
        if not following or following[0].upper() != "CONNECTIVITY":
            raise reader.error("expected CONNECTIVITY behind OFFSETS")
        return offsets if first else np.zeros(1, np.int64), reader.numbers(second, following[-1]).astype(np.int64)
    reader.rest = before
    mixed = reader.numbers(second, "int").astype(np.int64)
    places, place = np.zeros(first + 1, np.int64), 0
    for cell in range(first):
        if place >= second or not 0 <= mixed[place] < second - place:
            raise reader.error(f"expected {first:,} cells in {second:,} numbers, cell {cell:,} has no place")
        places[cell] = place
        place += int(mixed[place]) + 1
    places[first] = place
    kept = np.ones(second, bool)
    kept[places[:-1]] = False
    kept[place:] = False
    return places - np.arange(first + 1), mixed[kept]


def _vectors(reader: _Reader, words: list[str], written: list[str], parts: _Parts) -> None:
    _arguments(reader, words, 2)
    values = reader.numbers(3 * parts.count, words[-1])
    if parts.at_points:
        parts.vectors[written[1]] = values.reshape(-1, 3)


def _scalars(reader: _Reader, words: list[str], written: list[str], parts: _Parts) -> None:
    _arguments(reader, words, 2)
    width = reader.count(words[3]) if len(words) > 3 else 1
    before = reader.rest
    if [word.upper() for word in reader.line()[:1]] != ["LOOKUP_TABLE"]:
        reader.rest = before
    reader.numbers(width * parts.count, words[2] if len(words) > 2 else words[1])


def _field(reader: _Reader, words: list[str], written: list[str], parts: _Parts) -> None:
    for _ in range(reader.count(_arguments(reader, words, 2)[1])):
        own = reader.line()
        while own[:1] == ["METADATA"]:
            _, _, reader.rest = reader.rest.partition(b"\n\n")
            own = reader.line()
        if len(own) < 4 or own[3].lower() == "string":
            raise reader.error(f"expected name, width, length and type of an array, got {' '.join(own)[:60]!r}")
        width, count = reader.count(own[1]), reader.count(own[2])
        values = reader.numbers(width * count, own[3])
        if parts.at_points and width == 3 and count == parts.count:
            parts.vectors[own[0]] = values.reshape(-1, 3)


def _skipped(width: int) -> "Callable[[_Reader, list[str], list[str], _Parts], None]":
    def skip(reader: _Reader, words: list[str], written: list[str], parts: _Parts) -> None:
        _arguments(reader, words, 2)
        reader.numbers(width * parts.count, words[-1])

    return skip


def _table(reader: _Reader, words: list[str], written: list[str], parts: _Parts) -> None:
    _arguments(reader, words, 2)
    reader.numbers(4 * reader.count(words[2]), "unsigned_char" if reader.binary else "float")


def _coordinates(reader: _Reader, words: list[str], written: list[str], parts: _Parts) -> None:
    _, width, kind = _arguments(reader, words, 3)
    reader.numbers(reader.count(width) * parts.count, kind)


def _colors(reader: _Reader, words: list[str], written: list[str], parts: _Parts) -> None:
    width = reader.count(_arguments(reader, words, 2)[1])
    reader.numbers(width * parts.count, "unsigned_char" if reader.binary else "float")


ATTRIBUTES: "dict[str, Callable[[_Reader, list[str], list[str], _Parts], None]]" = {
    "vectors": _vectors,
    "normals": _skipped(3),
    "tensors": _skipped(9),
    "tensors6": _skipped(6),
    "global_ids": _skipped(1),
    "pedigree_ids": _skipped(1),
    "scalars": _scalars,
    "field": _field,
    "lookup_table": _table,
    "texture_coordinates": _coordinates,
    "color_scalars": _colors,
}


def _structured(points: Floats, dimensions: tuple[int, ...], reader: _Reader) -> Grid:
    """A curvilinear grid as quadrilaterals or hexahedra."""
    if np.prod(dimensions, dtype=float) != len(points):
        raise reader.error(f"expected {' x '.join(map(str, dimensions))} points, got {len(points):,}")
    x, y, z = (max(size - 1, 1) for size in dimensions)
    numbers = np.arange(len(points)).reshape(dimensions[::-1])

    def corner(dx: int, dy: int, dz: int) -> Ints:
        return numbers[dz : dz + z, dy : dy + y, dx : dx + x].ravel()

    flat = [axis for axis, size in enumerate(dimensions) if size == 1]
    around = [(0, 0), (1, 0), (1, 1), (0, 1)]
    if not flat:
        corners, kind = [corner(dx, dy, dz) for dz in (0, 1) for dx, dy in around], HEXAHEDRON
    elif len(flat) == 1:
        corners, kind = [corner(*np.insert(step, flat[0], 0).tolist()) for step in around], QUAD
    else:
        raise reader.error(f"expected a grid of two or three dimensions, got {' x '.join(map(str, dimensions))}")
    cells = np.stack(corners, axis=1)
    offsets = np.arange(len(cells) + 1) * cells.shape[1]
    return Grid(points, cells.ravel(), offsets, np.full(len(cells), kind))


def _no_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return True
    return False
