"""VTK's cell types, and their corners.

https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html
"""

import numpy as np

from odeform.errors import InputError
from odeform.formats.cells import Cells
from odeform.types import Ints

__all__ = ["cells_of"]

KINDS = {
    **{5: ("triangle", 3), 8: ("pixel", 4), 9: ("quad", 4), 10: ("tetrahedron", 4), 11: ("voxel", 8)},
    **{12: ("hexahedron", 8), 13: ("wedge", 6), 14: ("pyramid", 5)},
    # with nodes between corners, which come after them
    **{22: ("triangle", 3), 69: ("triangle", 3), 76: ("triangle", 3), 34: ("triangle", 3)},
    **{23: ("quad", 4), 28: ("quad", 4), 30: ("quad", 4), 70: ("quad", 4), 77: ("quad", 4)},
    **{24: ("tetrahedron", 4), 71: ("tetrahedron", 4), 78: ("tetrahedron", 4)},
    **{
        25: ("hexahedron", 8),
        29: ("hexahedron", 8),
        33: ("hexahedron", 8),
        72: ("hexahedron", 8),
        79: ("hexahedron", 8),
    },
    **{26: ("wedge", 6), 31: ("wedge", 6), 32: ("wedge", 6), 73: ("wedge", 6), 80: ("wedge", 6)},
    **{27: ("pyramid", 5), 37: ("pyramid", 5), 74: ("pyramid", 5), 81: ("pyramid", 5)},
}
OTHERS = {1: "vertex", 2: "vertex", 7: "polygon", 6: "strip"}
POLYHEDRON = 42
MIDDLE = 21  # types from here on have nodes between corners


def cells_of(types: Ints, corners: Ints, counts: Ints, where: str) -> list[Cells]:
    """Cells by kind, of their types (C,), corners (M,) one after the other, and how many each has (C,).

    Raises:
        InputError: For polyhedra, and cells with fewer corners than their type has.
    """
    first, out = np.cumsum(counts) - counts, []
    for kind in np.unique(types):
        chosen = types == kind
        sizes, starts = counts[chosen], first[chosen]
        if kind == POLYHEDRON:
            raise InputError(f"{where}: polyhedra are not read: split them into tetrahedra")
        name, size = KINDS.get(int(kind), ("", 0))
        if not name:
            within = np.arange(int(sizes.sum())) - np.repeat(np.cumsum(sizes) - sizes, sizes)
            nodes = corners[np.repeat(starts, sizes) + within]
            out.append(Cells(OTHERS.get(int(kind), ""), nodes, sizes))
            continue
        if (sizes < size).any():
            raise InputError(f"{where}: expected {size} corners of a {name}, got {sizes.min()}")
        nodes = corners[(starts[:, None] + np.arange(size))].ravel()
        out.append(Cells(name, nodes, np.full(len(sizes), size), bool(kind > MIDDLE)))
    return out
