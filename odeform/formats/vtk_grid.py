"""Points and cells of a VTK file, and the surface of them."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from odeform.errors import InputError
from odeform.formats.cells import surface
from odeform.formats.vtk_kinds import cells_of
from odeform.types import Floats, Geometry, Ints, Mesh

__all__ = ["POLYGON", "STRIP", "Grid", "geometry_of", "outside_of"]

STRIP, POLYGON = 6, 7


@dataclass(frozen=True)
class Grid:
    """A data set of VTK.

    Attributes:
        points: (N, 3) in the units of the file.
        connectivity: Indices of points, cell after cell.
        offsets: (C + 1,) where each cell starts in `connectivity`.
        types: (C,) as in vtkCellType.h.
        vectors: Fields of vectors (N, 3) at the points, by name.
        notes: What was left out.
    """

    points: Floats
    connectivity: Ints
    offsets: Ints
    types: Ints
    vectors: Mapping[str, Floats] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def geometry_of(grid: Grid, where: str) -> Geometry:
    """The surface of solid cells, else the cells that are faces, on all points in their order; the points alone where
    there are neither. Raises `InputError`, which `where` leads, for cells that are not in the file, or not known."""
    offsets, connectivity = grid.offsets, grid.connectivity
    if len(offsets) != len(grid.types) + 1 or offsets[0] != 0 or offsets[-1] > len(connectivity):
        raise InputError(
            f"{where}: expected offsets of {len(grid.types)} cells within {len(connectivity)} indices of points"
        )
    if (np.diff(offsets) < 0).any():
        raise InputError(f"{where}: expected offsets of cells that increase")
    cells = cells_of(grid.types, connectivity, np.diff(offsets), where)
    return surface(grid.points, cells, where, list(grid.notes))


def outside_of(grid: Grid, where: str) -> Geometry:
    """The surface, as `geometry_of` finds it, on its own points alone: those inside a volume are left out."""
    shape = geometry_of(grid, where)
    if not isinstance(shape, Mesh):
        return shape
    used, numbered = np.unique(shape.faces, return_inverse=True)
    return Mesh(shape.points[used], numbered.reshape(shape.faces.shape).astype(np.int32), None, shape.notes)
