"""Finite elements as a surface: the faces of solid cells that no other cell shares, or the cells that are faces."""

import itertools
from dataclasses import dataclass

import numpy as np

from odeform.errors import InputError, counted
from odeform.formats.polygons import triangulated
from odeform.types import Floats, Geometry, Ints, Mesh, PointCloud

__all__ = ["FLAT", "SOLID", "Cells", "surface"]

SOLID: dict[str, tuple[tuple[int, ...], ...]] = {
    "tetrahedron": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "voxel": ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}
"""Faces of solid cells, all counter-clockwise from outside, or all from inside where a cell is turned inside out."""
FLAT = {"triangle": (0, 1, 2), "quad": (0, 1, 2, 3), "pixel": (0, 1, 3, 2)}
"""Corners of flat cells, around the cell."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of one kind.

    Attributes:
        kind: A key of `SOLID` or `FLAT`; "polygon" and "strip" have corners of any number; "vertex" says nothing that
            the points do not, and anything else is left out with a note.
        corners: (M,) vertices of all cells, one cell after the other.
        counts: (C,) corners of each cell.
        middle: Whether there are nodes between corners, which are left out.
    """

    kind: str
    corners: Ints
    counts: Ints
    middle: bool = False


def surface(points: Floats, cells: list[Cells], where: str, notes: list[str]) -> Geometry:
    """Returns the surface of all solid cells, else all flat ones, else the points (N, 3).

    Raises:
        InputError: For cells that refer to no vertex, and faces of which none has three corners.
    """
    for group in cells:
        if len(group.corners) and not 0 <= group.corners.min() <= group.corners.max() < len(points):
            wrong = group.corners.min() if group.corners.min() < 0 else group.corners.max()
            raise InputError(f"{where}: a cell refers to vertex {wrong}, of {len(points)}")
    solid = [group for group in cells if group.kind in SOLID and len(group.counts)]
    flat = [
        group for group in cells if (group.kind in FLAT or group.kind in ("polygon", "strip")) and len(group.counts)
    ]
    shown = {*SOLID, *FLAT, "polygon", "strip", "vertex"}
    other = sum(len(group.counts) for group in cells if group.kind not in shown)
    if other:
        notes.append(f"{counted(other, 'cell')}, neither solid nor a face, left out")
    if any(group.middle for group in (*solid, *flat)):
        notes.append("nodes between the corners of cells left out")
    if solid and flat:
        notes.append(f"{counted(sum(len(group.counts) for group in flat), 'face')} beside the solid cells left out")
    if solid:
        corners, counts = _boundary(points, solid)
    elif flat:
        corners, counts = _faces(flat)
    else:
        return PointCloud(points, None, tuple(notes))
    triangles, _ = triangulated(points, corners, counts)
    if not len(triangles):
        raise InputError(f"{where}: expected cells of at least three corners, got none")
    return Mesh(points, corners[triangles], None, tuple(notes))


def _boundary(points: Floats, groups: list[Cells]) -> tuple[Ints, Ints]:
    """Corners and sizes of the faces that belong to one cell alone, counter-clockwise from outside."""
    rows = []
    for group in groups:
        nodes = group.corners.reshape(len(group.counts), -1)
        inside_out = _volumes(points, nodes, SOLID[group.kind]) < 0.0  # programs number wedges in two ways
        for face in SOLID[group.kind]:
            corners = nodes[:, face]
            corners[inside_out] = corners[inside_out][:, ::-1]
            # -1 fills the rows of triangles up to those of quads
            rows.append(np.pad(corners, ((0, 0), (0, 4 - len(face))), constant_values=-1))
    faces = np.concatenate(rows)
    _, first, number = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outer = faces[np.sort(first[number == 1])]
    return outer[outer >= 0], (outer >= 0).sum(axis=1)


def _volumes(points: Floats, nodes: Ints, faces: tuple[tuple[int, ...], ...]) -> Floats:
    """(C,) six times the volumes of cells, whose corners are `nodes` (C, K)."""
    places = np.asarray(points, dtype=float)[nodes]
    places = places - places.mean(axis=1, keepdims=True)
    total = np.zeros(len(nodes))
    for first, *others in faces:
        for one, two in itertools.pairwise(others):
            a, b, c = (places[:, corner] for corner in (first, one, two))
            total += np.einsum("ci,ci->c", a, np.cross(b, c))
    return total


def _faces(groups: list[Cells]) -> tuple[Ints, Ints]:
    corners, counts = [], []
    for group in groups:
        if group.kind == "polygon":
            corners.append(group.corners)
            counts.append(group.counts)
        elif group.kind == "strip":
            stops = np.cumsum(group.counts)
            for start, stop in zip(stops - group.counts, stops, strict=True):
                strip = group.corners[start:stop]
                first = np.arange(max(len(strip) - 2, 0))
                odd = first % 2
                corners.append(strip[np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)].ravel())
                counts.append(np.full(len(first), 3))
        else:
            nodes = group.corners.reshape(len(group.counts), -1)[:, FLAT[group.kind]]
            corners.append(nodes.ravel())
            counts.append(np.full(len(nodes), nodes.shape[1]))
    return np.concatenate(corners), np.concatenate(counts)
