"""The faces of an OBJ file: which vertex, and which texture coordinate, each corner refers to."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.formats.text import Lines, numbers_of, words_per_line
from odeform.types import Ints

__all__ = ["Corners", "read_corners"]

NONE = np.iinfo(np.int64).min


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners of all polygons, one polygon after the other.

    Attributes:
        counts: (P,) how many corners each polygon has.
        line: (P,) the line of each polygon, from 0.
        vertex: (C,) the vertex of each corner.
        texture: (C,) the texture coordinate of each corner, -1 without; None if no corner has any.
        short: How many faces had fewer than three corners, which are not among these.
    """

    counts: Ints
    line: Ints
    vertex: Ints
    texture: Ints | None
    short: int


def read_corners(lines: Lines, is_vertex: NDArray[np.bool_], where: str) -> Corners:
    """Reads the faces of a file, of whose lines `is_vertex` (L,) marks the vertices.

    Negative numbers count back from the last vertex before the face.

    Raises:
        InputError: For a face that refers to no vertex, or has fewer than three corners at the end of the file.
    """
    chosen = lines.starting(b"f") | lines.starting(b"fo")  # fo is an old name
    where_faces = np.flatnonzero(chosen)
    text = lines.without(chosen, b"f").replace(b"o", b" ")
    counts = words_per_line(text)
    if len(counts) and counts[-1] < 3 and where_faces[-1] >= len(lines) - 1:
        raise InputError(f"{where}: line {where_faces[-1] + 1}: a face of {counts[-1]} corners: truncated?")
    written, texture = _references(text, counts, where, where_faces + 1)
    face = np.repeat(np.arange(len(counts)), counts)
    vertex = _absolute(written, np.cumsum(is_vertex, dtype=np.int64)[where_faces][face])
    wrong = np.flatnonzero((vertex < 0) | (vertex >= is_vertex.sum()))
    if len(wrong):
        line = where_faces[face[wrong[0]]] + 1
        raise InputError(f"{where}: line {line}: refers to vertex {written[wrong[0]]}, of {is_vertex.sum()}")
    if texture is not None:
        before = np.cumsum(lines.starting(b"vt"), dtype=np.int64)[where_faces][face]
        texture = np.where(texture == NONE, -1, _absolute(texture, before))
    whole = counts >= 3
    if whole.all():
        return Corners(counts, where_faces, vertex, texture, 0)
    kept = whole[face]
    texture = None if texture is None else texture[kept]
    return Corners(counts[whole], where_faces[whole], vertex[kept], texture, int((~whole).sum()))


def _absolute(written: Ints, before: Ints) -> Ints:
    """References from 1 on, or from -1 back -> indices; below 0 where they are 0 or before the first."""
    return np.where(written > 0, written - 1, np.where(written < 0, before + written, -1))


def _references(text: bytes, counts: Ints, where: str, lines: Ints) -> tuple[Ints, Ints | None]:
    """(C,) vertices, and texture coordinates, as they are written: a, a/b, a//c or a/b/c."""
    total = int(counts.sum())
    slashes = text.count(b"/")
    if not slashes:
        return numbers_of(text, where, lines, np.int64), None
    doubled = text.count(b"//")
    if slashes == 2 * total and doubled == total:
        flat = _uniform(text.replace(b"//", b" "), total, 2)
        if flat is not None:
            return flat[:, 0], None
    elif not doubled and slashes in (total, 2 * total) and _even(text, slashes // total):
        flat = _uniform(text.replace(b"/", b" "), total, 1 + slashes // total)
        if flat is not None:
            return flat[:, 0], flat[:, 1]
    return _mixed(text, where, lines)


def _even(text: bytes, each: int) -> bool:
    """Whether every word has this many slashes."""
    data = np.frombuffer(text, np.uint8)
    gap = (data == 32) | (data == 10)
    first = np.flatnonzero(~gap & np.concatenate([[True], gap[:-1]]))
    return bool((np.add.reduceat(data == 47, first) == each).all())


def _uniform(text: bytes, total: int, width: int) -> Ints | None:
    try:
        flat = numbers_of(text, "", range(0), np.int64)
    except InputError:
        return None
    return flat.reshape(total, width) if len(flat) == total * width else None


def _mixed(text: bytes, where: str, lines: Ints) -> tuple[Ints, Ints]:
    """Corners of several forms, word by word."""
    vertices: list[int] = []
    textures: list[int] = []
    for number, line in zip(lines, text.splitlines(), strict=True):
        for word in line.split():
            vertex, _, rest = word.partition(b"/")
            texture = rest.partition(b"/")[0]
            try:
                vertices.append(_bounded(vertex))
                textures.append(_bounded(texture) if texture else NONE)
            except ValueError:
                shown = word[:40].decode("latin-1")
                raise InputError(
                    f"{where}: line {number}: expected corners as v, v/vt, v//vn or v/vt/vn, got {shown!r}"
                ) from None
    return np.array(vertices, np.int64), np.array(textures, np.int64)


def _bounded(word: bytes) -> int:
    value = int(word)
    if abs(value) > 1 << 40:
        raise ValueError(word)
    return value
