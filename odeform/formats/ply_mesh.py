"""PLY files of meshes and points: polygons, triangle strips, and colors of vertices, faces and textures."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.budget import require_memory
from odeform.errors import InputError, counted
from odeform.formats.beside import read_image
from odeform.formats.ply import Header
from odeform.formats.ply_data import Lists, Rows, read_rows
from odeform.formats.polygons import triangulated
from odeform.formats.textures import sampled
from odeform.types import Faces, Floats, Geometry, Ints, Mesh, PointCloud

__all__ = ["channels", "read_ply_mesh"]

BYTES_PER_BYTE = 20  # of memory while reading
READ = ("vertex", "face", "tristrips")
CORNERS = ("vertex_indices", "vertex_index", "vertex_indexes")
COLORS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))
COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texcoord_u", "texcoord_v"))


def read_ply_mesh(path: Path, header: Header, merge: bool) -> Geometry:
    """A mesh, or points where the file has no faces. Without `merge` a mesh has no colors.

    Raises:
        InputError: For missing rows, and faces that refer to no vertex.
    """
    where, size = f"geometry {path}", path.stat().st_size
    require_memory(where, f"{size:,} bytes of .ply", BYTES_PER_BYTE * size)
    notes: list[str] = []
    rows = read_rows(path, header, notes)
    vertices = rows.get("vertex", {})
    xyz = [_numbers(vertices, name) for name in "xyz"]
    if any(values is None for values in xyz):
        found = ", ".join(list(vertices)[:9]) or "no such element"
        raise InputError(f"{where}: expected an element vertex with x, y and z, got {found}")
    double = any(np.asarray(values).dtype.itemsize > 4 for values in xyz)
    points = np.stack([np.asarray(values, np.float64 if double else np.float32) for values in xyz], axis=1)
    notes += [
        f"{counted(element.rows, 'edge')} left out"
        if element.name == "edge"
        else f"{counted(element.rows, 'row')} of {element.name} left out"
        for element in header.elements
        if element.name not in READ and element.rows
    ]
    corners, triangles, polygon = _triangles(rows, points, where, notes)
    if not len(triangles):
        if any(element.rows for element in header.elements if element.name in ("face", "tristrips")):
            raise InputError(f"{where}: expected faces of at least three corners, got none")
        return PointCloud(points, channels(vertices), tuple(notes))
    colors = _colors(path, header, rows, corners, triangles, polygon, notes) if merge else None
    return Mesh(points, corners[triangles], colors, tuple(notes))


def channels(rows: Rows) -> NDArray[np.uint8] | None:
    """(rows, 3) red, green and blue, 0 to 255, whatever they are called; None without."""
    for names in COLORS:
        found = [_numbers(rows, name) for name in names]
        if all(values is not None for values in found):
            values = np.stack([np.asarray(column) for column in found], axis=1)
            if values.dtype.kind == "f":
                top = 1.0 if np.nanmax(values, initial=0.0) <= 1.0 else 255.0
            else:
                top = 65535.0 if values.dtype.itemsize == 2 else 255.0
            if top == 255.0 and values.dtype == np.uint8:
                return values
            return np.round(255.0 / top * np.clip(np.nan_to_num(values), 0.0, top)).astype(np.uint8)
    return None


def _numbers(rows: Rows, name: str) -> NDArray[Any] | None:
    found = rows.get(name)
    return None if isinstance(found, Lists) else found


def _triangles(rows: dict[str, Rows], points: Floats, where: str, notes: list[str]) -> tuple[Ints, Faces, Ints]:
    """Corners (C,), triangles (F, 3) of them, and the face (F,) of each; of strips, -1."""
    faces = rows.get("face", {})
    lists, strip = _corner_lists(faces), _corner_lists(rows.get("tristrips", {}))
    if lists is None and any(isinstance(entry, Lists) and len(entry.counts) for entry in faces.values()):
        raise InputError(f"{where}: expected faces with a list {CORNERS[0]}, got {', '.join(faces)[:100]}")
    if strip is not None and lists is not None:
        notes.append(f"{counted(len(strip.counts), 'strip')} beside the faces left out")
    if strip is not None and lists is None:
        corners = _whole(strip.values, where)
        _require_vertices(corners, strip.counts, len(points), where, least=-1)
        triangles = _strips(corners, strip.counts)
        return corners, triangles, np.full(len(triangles), -1)
    if lists is None:
        return np.zeros(0, np.int64), np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    corners = _whole(lists.values, where)
    _require_vertices(corners, lists.counts, len(points), where)
    triangles, polygon = triangulated(points, corners, lists.counts)
    return corners, triangles, polygon


def _corner_lists(rows: Rows) -> Lists | None:
    """The corners of faces or strips; None without any."""
    lists = (found for name in CORNERS if isinstance(found := rows.get(name), Lists))
    return next((found for found in lists if len(found.counts)), None)


def _whole(values: NDArray[Any], where: str) -> Ints:
    if values.dtype.kind == "f" and not (values == np.round(values)).all():
        raise InputError(f"{where}: expected faces of whole numbers")
    return values.astype(np.int32 if values.dtype.kind == "i" and values.dtype.itemsize <= 4 else np.int64, copy=False)


def _require_vertices(corners: Ints, counts: Ints, count: int, where: str, least: int = 0) -> None:
    if len(corners) and not least <= corners.min() <= corners.max() < count:
        wrong = int(np.argmax((corners < least) | (corners >= count)))
        face = int(np.searchsorted(np.cumsum(counts), wrong, side="right")) + 1
        raise InputError(f"{where}: face {face} refers to vertex {corners[wrong]}, of {count}")


def _strips(corners: Ints, counts: Ints) -> Faces:
    """Strips, which -1 or the end of a row ends, as triangles of places in `corners`."""
    if len(corners) < 3:
        return np.zeros((0, 3), np.int64)
    place = np.arange(len(corners))
    begins = np.zeros(len(corners), bool)
    begins[(np.cumsum(counts) - counts)[counts > 0]] = True
    begins[1:] |= corners[:-1] == -1
    start = np.maximum.accumulate(np.where(begins, place, 0))
    first = place[:-2]
    whole = (start[2:] == start[:-2]) & (corners[:-2] != -1) & (corners[1:-1] != -1) & (corners[2:] != -1)
    first = first[whole]
    odd = (first - start[first]) % 2
    faces = np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)
    a, b, c = corners[faces].T
    return faces[(a != b) & (b != c) & (c != a)]


def _colors(
    path: Path,
    header: Header,
    rows: dict[str, Rows],
    corners: Ints,
    triangles: Faces,
    polygon: Ints,
    notes: list[str],
) -> NDArray[np.uint8] | None:
    """(F, 3, 3) colors of the corners: of a texture, else of vertices, else of faces."""
    uv = _coordinates(rows, corners, triangles)
    if header.textures and len(header.textures) > 1:
        notes.append(f"{len(header.textures)} textures left out: one is read at most")
    elif header.textures:
        image = read_image((path,), header.textures[0], notes)
        if image is not None and uv is not None:
            return sampled(image, uv.reshape(-1, 2)).reshape(-1, 3, 3).astype(np.uint8)
        if image is not None:
            notes.append("the texture left out: the file has no coordinates of it")
    of_vertices = channels(rows["vertex"])
    if of_vertices is not None:
        return of_vertices[corners[triangles]]
    of_faces = channels(rows.get("face", {})) if (polygon >= 0).all() else None
    return None if of_faces is None else np.repeat(of_faces[polygon][:, None], 3, axis=1)


def _coordinates(rows: dict[str, Rows], corners: Ints, triangles: Faces) -> Floats | None:
    """(F, 3, 2) texture coordinates of the corners; None without."""
    lists = rows.get("face", {}).get("texcoord")
    if isinstance(lists, Lists):
        faces = _corner_lists(rows["face"])
        if faces is not None and np.array_equal(lists.counts, 2 * faces.counts):
            return lists.values.reshape(-1, 2)[triangles].astype(float)
    for names in COORDINATES:
        found = [_numbers(rows["vertex"], name) for name in names]
        if all(values is not None for values in found):
            return np.stack([np.asarray(column, float) for column in found], axis=1)[corners[triangles]]
    return None
