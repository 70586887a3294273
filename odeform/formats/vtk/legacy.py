"""Legacy VTK files, text or binary: polygons and unstructured grids, as a surface.

https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.budget import MEMORY, read_limited, require_memory
from odeform.errors import InputError
from odeform.formats.cells import Cells, surface
from odeform.formats.text import numbers_of
from odeform.formats.vtk.kinds import cells_of
from odeform.types import Floats, Geometry, Ints

__all__ = ["read_vtk"]

BYTES_PER_BYTE = 10  # of memory while reading
TYPES = {
    **{"char": "i1", "unsigned_char": "u1", "short": "i2", "unsigned_short": "u2", "int": "i4", "unsigned_int": "u4"},
    **{"long": "i8", "unsigned_long": "u8", "float": "f4", "double": "f8", "vtkidtype": "i4", "vtktypeint64": "i8"},
    **{"vtktypeint32": "i4"},
}
POLYGONS = {"POLYGONS": "polygon", "TRIANGLE_STRIPS": "strip", "LINES": "line", "VERTICES": "vertex"}
ATTRIBUTES = ("POINT_DATA", "CELL_DATA")
DATASETS = ("POLYDATA", "UNSTRUCTURED_GRID")


@dataclass
class _Reader:
    """A position in a file, from which words and arrays are read."""

    data: bytes
    where: str
    binary: bool = False
    position: int = 0
    points: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    cells: list[Cells] = field(default_factory=list)
    grid: tuple[Ints, Ints] | None = None
    types: Ints | None = None

    def line(self) -> str:
        """The next line."""
        stop = self.data.find(b"\n", self.position)
        stop = len(self.data) if stop < 0 else stop
        text = self.data[self.position : stop].decode("latin-1").strip()
        self.position = stop + 1
        return text

    def words(self) -> list[str]:
        """The words of the next line that has any; empty at the end."""
        while self.position < len(self.data):
            if words := self.line().split():
                return words
        return []

    def array(self, count: int, kind: str) -> NDArray[Any]:
        """The next `count` numbers of a type. Raises `InputError` where the file ends before."""
        if kind.lower() not in TYPES:
            raise InputError(f"{self.where}: expected a type of {', '.join(TYPES)}, got {kind[:20]!r}")
        dtype = np.dtype(">" + TYPES[kind.lower()])
        if not self.binary:
            return self._numbers(count).astype(dtype.newbyteorder("="))
        size = count * dtype.itemsize
        if self.position + size > len(self.data):
            raise self.short(count, (len(self.data) - self.position) // dtype.itemsize)
        out = np.frombuffer(self.data, dtype, count, self.position)
        self.position += size
        return out.astype(dtype.newbyteorder("="))

    def short(self, count: int, got: int) -> InputError:
        """An error that says that the file ends too early."""
        return InputError(f"{self.where}: expected {count:,} numbers, got {got:,}: truncated?")

    def _numbers(self, count: int) -> Floats:
        found, start, missing = [], self.position, count
        first = self.data.count(b"\n", 0, start) + 1
        while missing > 0:
            # a chunk that ends with a line, of about as many numbers as are missing
            stop = self.data.find(b"\n", min(start + 8 * missing, len(self.data)))
            stop = len(self.data) if stop < 0 else stop
            words = self.data[start:stop].split()
            if not words:
                if stop >= len(self.data):
                    raise self.short(count, count - missing)
                start = stop + 1
                continue
            if len(words) > missing:  # what follows begins in this chunk
                stop = self._after(start, missing)
                words = words[:missing]
            lines = range(first + self.data.count(b"\n", self.position, start), 1 << 40)
            found.append(numbers_of(self.data[start:stop] + b"\n", self.where, lines))
            missing -= len(words)
            start = stop
        self.position = start
        return np.concatenate(found) if found else np.zeros(0)

    def _after(self, start: int, count: int) -> int:
        """The position after `count` words."""
        gap = np.isin(np.frombuffer(self.data, np.uint8, -1, start), (9, 10, 13, 32))
        ends = np.flatnonzero(gap[1:] & ~gap[:-1]) + 1
        return start + int(ends[count - 1]) if len(ends) >= count else len(self.data)


def read_vtk(path: Path, merge: bool) -> Geometry:
    """The polygons of a file, the surface of its solid cells, or its points.

    Raises:
        InputError: For other data sets than polygons and unstructured grids, and for files that are cut short.
    """
    where, size = f"geometry {path}", path.stat().st_size
    require_memory(where, f"{size:,} bytes of .vtk", BYTES_PER_BYTE * size)
    reader = _Reader(read_limited(path, where, MEMORY // 4), where)
    if not reader.line().startswith("# vtk DataFile"):
        raise InputError(f"{where}: expected a first line '# vtk DataFile Version', got another file")
    reader.line()
    kind = (reader.words() or [""])[0].upper()
    if kind not in ("ASCII", "BINARY"):
        raise InputError(f"{where}: expected ASCII or BINARY in line 3, got {kind[:20]!r}")
    reader.binary = kind == "BINARY"
    if not reader.binary:
        reader.data = reader.data.replace(b"\r\n", b"\n")
        reader.position = reader.data.upper().find(b"ASCII") + 5
    words = reader.words()
    if words[:1] != ["DATASET"] or words[1:2] == [] or words[1].upper() not in DATASETS:
        got = " ".join(words)[:40] or "nothing"
        raise InputError(f"{where}: expected DATASET {' or '.join(DATASETS)}, got {got!r}: convert it to one of them")
    fields = _read_sections(reader)
    if reader.grid is not None:
        if reader.types is None or len(reader.types) != len(reader.grid[1]):
            got = 0 if reader.types is None else len(reader.types)
            raise InputError(f"{where}: expected CELL_TYPES of {len(reader.grid[1])} cells, got {got}: truncated?")
        reader.cells += cells_of(reader.types, *reader.grid, where)
    notes = ["values at points and cells left out"] if fields else []
    return surface(reader.points, reader.cells, where, notes)


def _read_sections(reader: _Reader) -> bool:
    """Points and cells; whether values follow them."""
    while words := reader.words():
        name = words[0].upper()
        if name in ATTRIBUTES:
            return True
        if name == "POINTS" and len(words) >= 3:
            count = _count(words[1], reader)
            require_memory(reader.where, f"{count:,} points", 60 * count)
            reader.points = (
                reader.array(3 * count, words[2])
                .astype(float if words[2].lower() == "double" else np.float32)
                .reshape(-1, 3)
            )
        elif name in POLYGONS and len(words) >= 3:
            corners, counts = _lists(reader, words)
            reader.cells.append(Cells(POLYGONS[name], corners, counts))
        elif name == "CELLS" and len(words) >= 3:
            reader.grid = _lists(reader, words)
        elif name == "CELL_TYPES" and len(words) >= 2:
            reader.types = reader.array(_count(words[1], reader), "int").astype(np.int64)
        elif name in ("METADATA", "INFORMATION", "NAME", "DATA", "COMPONENT_NAMES"):
            continue
        elif name == "FIELD" and len(words) >= 3:
            for _ in range(min(_count(words[2], reader), 1000)):
                shape = reader.words()
                if len(shape) < 4:
                    raise InputError(f"{reader.where}: expected a field of a name, two numbers and a type")
                reader.array(_count(shape[1], reader) * _count(shape[2], reader), shape[3])
        else:
            raise InputError(f"{reader.where}: expected POINTS, CELLS or POLYGONS, got {' '.join(words)[:40]!r}")
    return False


def _count(word: str, reader: _Reader) -> int:
    if not (word.isascii() and word.isdigit() and len(word) < 13):
        raise InputError(f"{reader.where}: expected a number of points or cells, got {word[:40]!r}")
    return int(word)


def _lists(reader: _Reader, words: list[str]) -> tuple[Ints, Ints]:
    """Corners (M,) of cells, one after the other, and how many each has (C,)."""
    cells, size = _count(words[1], reader), _count(words[2], reader)
    before = reader.position
    following = reader.words()
    if following and following[0].upper() == "OFFSETS":  # since version 5
        offsets = reader.array(cells, following[1] if len(following) > 1 else "").astype(np.int64)
        following = reader.words()
        if following[:1] != ["CONNECTIVITY"] or len(following) < 2:
            raise InputError(f"{reader.where}: expected CONNECTIVITY after OFFSETS")
        corners = reader.array(size, following[1]).astype(np.int64)
        counts = np.diff(offsets)
        if len(offsets) and (offsets[0] != 0 or (counts < 0).any() or offsets[-1] != size):
            raise InputError(f"{reader.where}: expected offsets from 0 to {size} that rise")
        return corners, counts
    reader.position = before
    flat = reader.array(size, "int").astype(np.int64)
    if cells and size % cells == 0 and (flat.reshape(cells, -1)[:, 0] == size // cells - 1).all():
        return flat.reshape(cells, -1)[:, 1:].ravel(), np.full(cells, size // cells - 1)
    counts, place = np.empty(min(cells, size), np.int64), 0
    for cell in range(cells):
        count = int(flat[place]) if place < size else -1
        if not 0 <= count < size - place:
            raise InputError(f"{reader.where}: cell {cell + 1}: expected a number of corners, got {count}")
        counts[cell] = count
        place += count + 1
    heads = np.cumsum(counts + 1) - counts - 1
    return np.delete(flat[:place], heads), counts
