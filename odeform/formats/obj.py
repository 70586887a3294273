"""Wavefront OBJ: vertices in the order of the file, polygons, and colors of vertices, materials and textures.

http://www.martinreddy.net/gfx/3d/OBJ.spec (Wavefront Technologies, Advanced Visualizer, appendix B1).
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from odeform.budget import require_memory
from odeform.errors import InputError, counted
from odeform.formats.obj_corners import Corners, read_corners
from odeform.formats.obj_materials import material_colors
from odeform.formats.polygons import triangulated
from odeform.formats.text import Lines, numbers_of, read_text, words_per_line
from odeform.types import Floats, Geometry, Ints, Mesh, PointCloud

__all__ = ["read_obj"]

BYTES_PER_BYTE = 16  # of memory while reading
BASES = (b"curv", b"curv2", b"surf")
CONTINUED = re.compile(rb"(?:[^\n]*\\\n)+[^\n]*")
"""A line that goes on behind a backslash."""


@dataclass(frozen=True, eq=False)
class _Table:
    """Numbers of the lines of one keyword: the first of each line at `first`, with `count` of them."""

    values: Floats
    first: Ints
    count: Ints

    def columns(self, start: int, stop: int) -> Floats:
        """(L, stop - start) numbers of each line."""
        if len(self.count) and (self.count == self.count[0]).all():
            return self.values.reshape(len(self.count), -1)[:, start:stop]
        return self.values[self.first[:, None] + np.arange(start, stop)]


def read_obj(path: Path, merge: bool) -> Geometry:
    """All polygons as triangles; points where there are none. Without `merge` there are no colors.

    Raises:
        InputError: A file without vertices, anything that is no number, and faces that refer to no vertex.
    """
    where = f"geometry {path}"
    size = path.stat().st_size
    require_memory(where, f"{size:,} bytes of .obj", BYTES_PER_BYTE * size)
    text = read_text(path)
    if b"\\\n" in text:
        text = CONTINUED.sub(_joined, text)
    lines, notes = Lines(text), []
    is_vertex = lines.starting(b"v")
    if not is_vertex.any():
        raise InputError(f"{where}: expected lines of vertices, v x y z, got none: not an OBJ file?")
    vertices = _table(lines, is_vertex, b"v", 3, where)
    points, painted = vertices.columns(0, 3), _painted(vertices, notes)
    corners = read_corners(lines, is_vertex, where)
    if corners.short:
        notes.append(f"{counted(corners.short, 'face')} of fewer than three corners left out")
    notes += _left_out(lines)
    if not corners.counts.size:
        if any(lines.starting(base).any() for base in BASES):
            raise InputError(f"{where}: expected polygons, got free-form curves or surfaces: export it as polygons")
        return PointCloud(points, None if painted is None else np.round(painted).astype(np.uint8), tuple(notes))
    triangles, polygon = triangulated(points, corners.vertex, corners.counts)
    colors = _colors(path, lines, corners, triangles, polygon, painted, notes) if merge else None
    return Mesh(points, corners.vertex[triangles], colors, tuple(notes))


def _joined(found: re.Match[bytes]) -> bytes:
    """One line, and empty ones after it, so that those that follow keep their numbers."""
    return found[0].replace(b"\\\n", b" ") + b"\n" * found[0].count(b"\n")


def _table(lines: Lines, chosen: NDArray[np.bool_], word: bytes, least: int, where: str) -> _Table:
    text, numbers = lines.without(chosen, word), np.flatnonzero(chosen) + 1
    counts = words_per_line(text)
    values = numbers_of(text, where, numbers)
    if (counts < least).any():
        odd = int(np.argmax(counts < least))
        raise InputError(
            f"{where}: line {numbers[odd]}: expected {least} numbers after {word.decode()}, got {counts[odd]}"
            + (": truncated?" if odd == len(counts) - 1 else "")
        )
    return _Table(values, np.cumsum(counts) - counts, counts)


def _painted(vertices: _Table, notes: list[str]) -> Floats | None:
    """(N, 3) colors of the vertices, 0 to 255, which some programs write behind their positions."""
    colors = vertices.columns(3, 6) if (vertices.count >= 6).all() else None
    if colors is None or not np.isfinite(colors).all():
        if (vertices.count >= 6).any():
            notes.append("colors left out: some vertices have none")
        return None
    return np.clip(colors if colors.max(initial=0.0) > 1.0 else 255.0 * colors, 0.0, 255.0)


def _left_out(lines: Lines) -> list[str]:
    names = {b"l": "line", b"curv": "curve", b"surf": "free-form surface"}
    found = {name: int(lines.starting(word).sum()) for word, name in names.items()}
    return [f"{counted(count, name)} left out" for name, count in found.items() if count]


def _colors(
    path: Path,
    lines: Lines,
    corners: Corners,
    triangles: Ints,
    polygon: Ints,
    painted: Floats | None,
    notes: list[str],
) -> NDArray[np.uint8] | None:
    """(F, 3, 3) colors of the corners of triangles: those of textures, else of vertices, else of materials."""
    names = [np.flatnonzero(lines.starting(word)) for word in (b"usemtl", b"mtllib")]
    used, libraries = ([(int(i), lines.line(int(i)).partition(" ")[2].strip()) for i in found] for found in names)
    is_uv = lines.starting(b"vt")
    uv = None
    if used and libraries and is_uv.any() and corners.texture is not None:
        uv = _table(lines, is_uv, b"vt", 1, f"geometry {path}")
        flat = uv.columns(0, 2) if (uv.count >= 2).all() else None
        at = corners.texture
        # without coordinates, as -1, a corner has those of the first
        uv = None if flat is None or at.max(initial=-1) >= len(flat) else flat[np.maximum(at, 0)]
    return material_colors(
        path,
        [name for _, name in libraries],
        used,
        corners.line[polygon],
        None if uv is None else uv[triangles],
        None if painted is None else painted[corners.vertex[triangles]],
        notes,
    )
