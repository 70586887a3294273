"""Points and cells of a VTK file, and the triangles of their surface.

Schroeder, Martin and Lorensen, "The Visualization Toolkit" (2006); numbers of cell types are those of vtkCellType.h.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from odeform.errors import InputError
from odeform.types import Faces, Floats, Geometry, Ints, Mesh, PointCloud

__all__ = ["POLYGON", "STRIP", "Grid", "geometry_of", "triangles_of"]

IGNORED = (0, 1, 2, 3, 4, 21, 35)
"""Empty cells, vertices and lines: no part of a surface."""
STRIP, POLYGON, PIXEL, VOXEL = 6, 7, 8, 11
FLAT = {5: 3, 9: 4, 22: 3, 23: 4, 28: 4, 30: 4, 34: 3}
"""Cells of a surface, and how many corners lead their points; nodes in the middle of edges follow."""
VOLUMES: dict[int, tuple[tuple[int, ...], ...]] = {
    10: ((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)),
    12: ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
    13: ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    14: ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    11: ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)),
}
"""The faces of cells of a volume, counter-clockwise from outside."""
QUADRATIC = {24: 10, 25: 12, 26: 13, 27: 14, 29: 12, 32: 13, 33: 12, 37: 14}
"""Of these the corners, which lead, are those of a linear cell."""
CORNERS = {10: 4, 12: 8, 13: 6, 14: 5, 11: 8}


@dataclass(frozen=True)
class Grid:
    """A data set of VTK.

    Attributes:
        points: (N, 3) in the units of the file.
        connectivity: Indices of points, cell after cell.
        offsets: (C + 1,) where each cell starts in `connectivity`.
        types: (C,) as in vtkCellType.h.
        vectors: Fields of vectors (N, 3) at the points, by name.
    """

    points: Floats
    connectivity: Ints
    offsets: Ints
    types: Ints
    vectors: Mapping[str, Floats] = field(default_factory=dict)


def geometry_of(grid: Grid, where: str) -> Geometry:
    """The surface as a mesh of all points in their order, or of those on the surface where cells are volumes; points
    alone if there are no cells of a surface. Raises `InputError`, which `where` leads, for unknown cells."""
    faces = triangles_of(grid, where)
    if not len(faces):
        return PointCloud(grid.points)
    if not np.isin(grid.types, [*VOLUMES, *QUADRATIC, 22, 23, 28, 30, 34]).any():
        return Mesh(grid.points, faces)
    used, numbered = np.unique(faces, return_inverse=True)
    return Mesh(grid.points[used], numbered.reshape(faces.shape).astype(np.int32))


def triangles_of(grid: Grid, where: str) -> Faces:
    """(F, 3) the cells that are surfaces, and the outer faces of volumes, which no two cells share."""
    _check(grid, where)
    counts = np.diff(grid.offsets)
    triangles, quads = [], []
    outer: dict[int, list[Ints]] = {3: [], 4: []}
    for kind in map(int, np.unique(grid.types)):
        chosen = np.flatnonzero(grid.types == kind)
        linear = QUADRATIC.get(kind, kind)
        if kind in IGNORED:
            continue
        if kind in FLAT or kind == PIXEL or linear in VOLUMES:
            least = CORNERS[linear] if linear in VOLUMES else FLAT.get(kind, 4)
            if (counts[chosen] < least).any():
                raise InputError(f"{where}: expected at least {least} points in cells of type {kind}")
            cells = grid.connectivity[grid.offsets[chosen][:, None] + np.arange(least)]
            if linear in VOLUMES:
                for face in VOLUMES[linear]:
                    outer[len(face)].append(cells[:, face])
            else:
                (triangles if least == 3 else quads).append(cells[:, [0, 1, 3, 2]] if kind == PIXEL else cells)
        elif kind in (STRIP, POLYGON):
            triangles.append(_of_lists(grid, chosen, counts[chosen], strips=kind == STRIP))
        else:
            raise InputError(
                f"{where}: cells of VTK's type {kind} are not read: triangulate them, in ParaView by "
                "Extract Surface and Triangulate"
            )
    for corners, found in outer.items():
        if found:
            (triangles if corners == 3 else quads).append(_once(np.concatenate(found)))
    for four in quads:
        triangles += [four[:, [0, 1, 2]], four[:, [0, 2, 3]]]
    faces = np.concatenate(triangles) if triangles else np.zeros((0, 3), int)
    same = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 2] == faces[:, 0])
    return faces[~same].astype(np.int32)


def _check(grid: Grid, where: str) -> None:
    """Raise `InputError` for cells that are not in the file, or refer to points that are not."""
    offsets, connectivity = grid.offsets, grid.connectivity
    if len(offsets) != len(grid.types) + 1 or offsets[0] != 0 or offsets[-1] > len(connectivity):
        raise InputError(
            f"{where}: expected offsets of {len(grid.types)} cells within {len(connectivity)} indices of points"
        )
    if (np.diff(offsets) < 0).any():
        raise InputError(f"{where}: expected offsets of cells that increase")
    if len(connectivity) and not 0 <= connectivity.min() <= connectivity.max() < len(grid.points):
        raise InputError(f"{where}: cells refer to points that do not exist, of {len(grid.points)}")


def _of_lists(grid: Grid, chosen: Ints, counts: Ints, strips: bool) -> Ints:
    """(F, 3) triangles of polygons, as fans, or of strips, of which every other one is turned."""
    found = [np.zeros((0, 3), int)]
    for size in np.unique(counts).tolist():
        if size < 3:
            continue
        cells = grid.connectivity[grid.offsets[chosen[counts == size]][:, None] + np.arange(size)]
        first = np.arange(size - 2)
        if strips:
            corners = np.stack([first, first + 1 + first % 2, first + 2 - first % 2], axis=1)
        else:
            corners = np.stack([0 * first, first + 1, first + 2], axis=1)
        found.append(cells[:, corners].reshape(-1, 3))
    return np.concatenate(found)


def _once(faces: Ints) -> Ints:
    """Those of (F, K) faces that only one cell has, in their order."""
    _, inverse, counts = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    return faces[counts[inverse.ravel()] == 1]
