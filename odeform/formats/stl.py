"""STL, binary and text: triangles without shared vertices.

https://www.fabbers.com/tech/STL_Format
"""

import re
from pathlib import Path

import numpy as np

from odeform.budget import MEMORY, read_limited, require_memory
from odeform.errors import InputError, counted
from odeform.formats.text import Lines, numbers_of, plain_text, words_per_line
from odeform.types import Floats, Mesh

__all__ = ["read_stl"]

HEADER = 84  # bytes before the first triangle of a binary file; the last four count them
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
COLORED = 1 << 15
"""Bit of the attribute of a triangle that has a color, unless the header has a color for all."""
BYTES_PER_BYTE = 14  # of memory while reading


def read_stl(path: Path, merge: bool) -> Mesh:
    """All triangles; each has vertices of its own.

    Raises:
        InputError: For a file that is cut short, or is no STL.
    """
    where, size = f"geometry {path}", path.stat().st_size
    require_memory(where, f"{size:,} bytes of .stl", BYTES_PER_BYTE * size)
    data = read_limited(path, where, MEMORY // 4)
    count = int.from_bytes(data[80:HEADER].ljust(4, b"\0"), "little")
    exact = len(data) == HEADER + FACET.itemsize * count
    head = data[:1024].removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    if not exact and head.startswith((b"solid", b"facet")) and b"\0" not in data[:4096]:
        corners, notes = _text_corners(data, where), []
    else:
        corners, notes = _binary_corners(data, count, where)
    return Mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), None, tuple(notes))


def _binary_corners(data: bytes, count: int, where: str) -> tuple[Floats, list[str]]:
    present, notes = max(len(data) - HEADER, 0) // FACET.itemsize, []
    if len(data) < HEADER or present < count:
        raise InputError(
            f"{where}: expected {HEADER + FACET.itemsize * count:,} bytes of {count:,} triangles of a binary STL, got "
            f"{len(data):,}: truncated, or no STL file?"
        )
    if not count:
        raise InputError(f"{where}: expected triangles, got a binary STL of none")
    extra = len(data) - HEADER - FACET.itemsize * count
    if extra >= FACET.itemsize * count + FACET.itemsize:  # the number is wrong, or this is something else
        raise InputError(
            f"{where}: expected {HEADER + FACET.itemsize * count:,} bytes of {count:,} triangles of a binary STL, got "
            f"{len(data):,}: no STL file?"
        )
    if extra:
        notes.append(f"{counted(extra, 'byte')} after the last triangle left out")
    facets = np.frombuffer(data, FACET, count, HEADER)
    marked = facets["attribute"] if b"COLOR=" in data[:80] else facets["attribute"] & COLORED
    if marked.any():
        notes.append("colors of triangles left out")
    return facets["corners"], notes


def _text_corners(data: bytes, where: str) -> Floats:
    text = plain_text(data).lower()
    lines = Lines(text)
    chosen, facets = lines.starting(b"vertex"), int(lines.starting(b"facet").sum())
    count, at = int(chosen.sum()), np.flatnonzero(chosen) + 1
    if b"vertex" not in text:
        raise InputError(f"{where}: expected facets of a text STL, got none")
    if text.count(b"vertex") != count and len(re.findall(rb"\bvertex\b", text)) != count:  # several in a line
        return _loose_corners(text, where)
    numbers = lines.without(chosen, b"vertex")
    counts, values = words_per_line(numbers), numbers_of(numbers, where, at)
    if (counts != 3).any():
        odd = int(np.argmax(counts != 3))
        cut = ": truncated?" if odd == len(counts) - 1 else ""
        raise InputError(f"{where}: line {at[odd]}: expected three numbers of a vertex, got {counts[odd]}{cut}")
    if count != 3 * facets or not lines.starting(b"endsolid").any():
        missing = "" if count != 3 * facets else " and no endsolid"
        raise InputError(
            f"{where}: expected three vertices for each facet, got {count} for {facets}{missing}: truncated?"
        )
    return values.reshape(-1, 3, 3)


def _loose_corners(text: bytes, where: str) -> Floats:
    """Corners of a text whose lines are not those that everyone writes."""
    found = re.findall(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", text)
    if len(found) % 3 or len(found) != 3 * len(re.findall(rb"\bfacet\s+normal\b", text)):
        raise InputError(f"{where}: expected three vertices for each facet, got {len(found)}: truncated?")
    return numbers_of(b"\n".join(b" ".join(words) for words in found) + b"\n", where, range(0)).reshape(-1, 3, 3)
