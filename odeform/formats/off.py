"""Object File Format: OFF, COFF, NOFF, STOFF and their combinations.

http://www.geomview.org/docs/html/OFF.html
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.formats.polygons import triangulated
from odeform.formats.text import numbers_of, read_text, require_words, words_per_line
from odeform.types import Floats, Ints, Mesh

__all__ = ["read_off"]

BYTES_PER_BYTE = 20  # of memory while reading
KEYWORD = re.compile(rb"(ST)?(C)?(N)?(4)?(n)?OFF\s*(.*)")


def read_off(path: Path, merge: bool) -> Mesh:
    """Reads a mesh with the colors of its vertices, else of its faces.

    Raises:
        InputError: For missing rows, no faces, binary files, and coordinates of other than three dimensions.
    """
    where, size = f"geometry {path}", path.stat().st_size
    require_memory(where, f"{size:,} bytes of .off", BYTES_PER_BYTE * size)
    text = read_text(path)
    if b"#" in text:
        text = re.sub(rb"#[^\n]*", b"", text)
    counts = words_per_line(text)
    lines = np.flatnonzero(counts)
    rows = text.split(b"\n")
    if not len(lines):
        raise InputError(f"{where}: expected OFF in the first line, got an empty file")
    first = rows[lines[0]].strip()
    # the keyword may be missing, or share its line with the numbers
    found = KEYWORD.fullmatch(first) or (KEYWORD.fullmatch(b"OFF " + first) if first[:1].isdigit() else None)
    if found is None or b"BINARY" in found[6] or found[4] or found[5]:
        raise InputError(
            f"{where}: expected text that starts with OFF, COFF, NOFF or STOFF, got {first[:40].decode('latin-1')!r}"
        )
    sizes, used = found[6].split(), 1
    if not sizes:
        sizes, used = (rows[lines[1]].split() if len(lines) > 1 else []), 2
    if len(sizes) < 2 or not all(value.isdigit() and len(value) < 13 for value in sizes[:2]):
        raise InputError(
            f"{where}: expected numbers of vertices, faces and edges, got {b' '.join(sizes)[:40].decode('latin-1')!r}"
        )
    vertices, faces = int(sizes[0]), int(sizes[1])
    lines = lines[used:]
    if len(lines) < vertices + faces:
        raise InputError(
            f"{where}: expected {vertices} vertices and {faces} faces, one in each line, got {len(lines)} lines: "
            "truncated?"
        )
    table = _numbers(rows, lines[:vertices], where)
    points, painted = _vertices(table, counts[lines[:vertices]], found, lines[:vertices] + 1, where)
    if not faces:
        raise InputError(f"{where}: a mesh without faces: convert points to .ply or .xyz")
    at = lines[vertices : vertices + faces]
    return _mesh(points, painted, _face_numbers(rows, at, where), counts[at], at + 1, where)


def _face_numbers(rows: list[bytes], lines: Ints, where: str) -> NDArray[Any]:
    """Reads as `_numbers` does; whole numbers, of faces without colors of fractions, are read twenty times as fast."""
    try:
        return _numbers(rows, lines, where, np.int64)
    except InputError:
        return _numbers(rows, lines, where)


def _numbers(rows: list[bytes], lines: Ints, where: str, dtype: Any = np.float64) -> NDArray[Any]:
    """All numbers from the first to the last of `lines` (L,); those between hold nothing."""
    first, last = (int(lines[0]), int(lines[-1])) if len(lines) else (0, -1)
    return numbers_of(b"\n".join(rows[first : last + 1]) + b"\n", where, range(first + 1, last + 2), dtype)


def _vertices(
    values: Floats, counts: Ints, found: re.Match[bytes], lines: Ints, where: str
) -> tuple[Floats, Floats | None]:
    """(N, 3) positions, and (N, 3) colors from 0 to 255."""
    least = 3 + (3 if found[3] else 0)
    extra = 2 if found[1] else 0
    if not len(counts):
        return np.zeros((0, 3)), None
    if (counts < least).any():
        require_words(counts, [least], where, lines, "numbers of a vertex")
    first = np.cumsum(counts) - counts
    points = values[first[:, None] + np.arange(3)]
    room = counts - least - extra
    if not (found[2] or (room.min() >= 3 and not extra)) or room.min() < 3:
        return points, None
    return points, _scaled(values[(first + least)[:, None] + np.arange(3)])


def _scaled(colors: Floats) -> Floats:
    """Colors from 0 to 255, of fractions too."""
    fractions = colors.max(initial=0.0) <= 1.0
    return np.round(np.clip(np.nan_to_num(255.0 * colors if fractions else colors), 0.0, 255.0))


def _mesh(points: Floats, painted: Floats | None, values: NDArray[Any], counts: Ints, lines: Ints, where: str) -> Mesh:
    start = np.cumsum(counts) - counts
    sizes = np.clip(np.nan_to_num(values[start]), -1, 1 << 40).astype(np.int64)
    short = np.flatnonzero((sizes < 1) | (counts < 1 + sizes))
    if len(short):
        odd = short[0]
        raise InputError(
            f"{where}: line {lines[odd]}: expected a face of {sizes[odd]} vertices, got {counts[odd] - 1} numbers: "
            "truncated?"
        )
    within = np.arange(int(sizes.sum())) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    corners = values[np.repeat(start + 1, sizes) + within].astype(np.int64)
    if len(corners) and not 0 <= corners.min() <= corners.max() < len(points):
        wrong = int(np.argmax((corners < 0) | (corners >= len(points))))
        line = lines[np.repeat(np.arange(len(sizes)), sizes)[wrong]]
        raise InputError(f"{where}: line {line}: refers to vertex {corners[wrong]}, of {len(points)}")
    triangles, polygon = triangulated(points, corners, sizes)
    notes = []
    colors: NDArray[Any] | None = None
    after = counts - 1 - sizes
    if painted is not None:
        colors = painted[corners[triangles]].astype(np.uint8)
    elif len(after) and after.min() >= 3:
        of_faces = _scaled(values[(start + 1 + sizes)[:, None] + np.arange(3)].astype(float))
        colors = np.repeat(of_faces[polygon][:, None], 3, axis=1).astype(np.uint8)
    elif after.max(initial=0) > 0:
        notes.append("colors of some faces left out")
    return Mesh(points, corners[triangles], colors, tuple(notes))
