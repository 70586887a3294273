"""VTK's XML files of unstructured grids (.vtu) and polygons (.vtp), as a surface.

https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html
"""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

from odeform.budget import MEMORY, read_limited, require_memory
from odeform.errors import InputError
from odeform.formats.cells import Cells, surface
from odeform.formats.vtk.arrays import Arrays
from odeform.formats.vtk.kinds import cells_of
from odeform.types import Geometry, Ints

__all__ = ["read_vtk_xml"]

BYTES_PER_BYTE = 10  # of memory while reading
APPENDED = re.compile(rb"<AppendedData\b([^>]*)>\s*_")
POLYGONS = {"Polys": "polygon", "Strips": "strip", "Lines": "line", "Verts": "vertex"}


def read_vtk_xml(path: Path, merge: bool) -> Geometry:
    """The polygons of a file, the surface of its solid cells, or its points; all pieces as one.

    Raises:
        InputError: For other kinds of files, unknown compression, and missing numbers.
    """
    where, size = f"geometry {path}", path.stat().st_size
    require_memory(where, f"{size:,} bytes of {path.suffix.lower()}", BYTES_PER_BYTE * size)
    data = read_limited(path, where, MEMORY // 4)
    appended, encoding = b"", ""
    if found := APPENDED.search(data):
        # raw bytes are no XML
        appended, encoding = data[found.end() :], "raw" if b"raw" in found[1] else "base64"
        data = data[: found.start()] + b"</VTKFile>"
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"{where}: expected XML of VTK: {error}: truncated?") from None
    kind = root.get("type", "")
    grid = root.find(kind) if kind in ("UnstructuredGrid", "PolyData") else None
    if root.tag != "VTKFile" or grid is None:
        raise InputError(
            f"{where}: expected a VTKFile of UnstructuredGrid or PolyData, got {root.tag[:40]} {kind[:40]!r}"
        )
    arrays = Arrays(root, appended, encoding, where)
    points, cells, first = [], [], 0
    for piece in grid.iter("Piece"):
        count = arrays.count(piece, "NumberOfPoints")
        found_points = arrays.read(piece.find("Points/DataArray"), 3 * count).reshape(-1, 3)
        points.append(found_points)
        for group in _cells(piece, arrays, where):
            cells.append(Cells(group.kind, group.corners + first, group.counts, group.middle))
        first += count
    if not first:
        raise InputError(f"{where}: expected points, got none")
    double = any(part.dtype == np.float64 for part in points)
    whole = np.concatenate(points).astype(np.float64 if double else np.float32)
    values = [name for name in ("PointData", "CellData") if any(len(part) for part in grid.iter(name))]
    return surface(whole, cells, where, ["values at points and cells left out"] if values else [])


def _cells(piece: ElementTree.Element, arrays: Arrays, where: str) -> list[Cells]:
    groups = []
    for name, kind in POLYGONS.items():
        count = arrays.count(piece, f"NumberOf{name}")
        if count:
            corners, counts = _lists(piece.find(name), count, arrays, where)
            groups.append(Cells(kind, corners, counts))
    count = arrays.count(piece, "NumberOfCells")
    if count:
        part = piece.find("Cells")
        corners, counts = _lists(part, count, arrays, where)
        types = arrays.read(_named(part, "types"), count).astype(np.int64)
        groups += cells_of(types, corners, counts, where)
    return groups


def _named(part: ElementTree.Element | None, name: str) -> ElementTree.Element | None:
    return (
        next((array for array in part.iter("DataArray") if array.get("Name") == name), None)
        if part is not None
        else None
    )


def _lists(part: ElementTree.Element | None, count: int, arrays: Arrays, where: str) -> tuple[Ints, Ints]:
    """Corners (M,) of cells, one after the other, and how many each has (C,)."""
    stops = arrays.read(_named(part, "offsets"), count).astype(np.int64)
    counts = np.diff(stops, prepend=0)
    if (counts < 0).any():
        raise InputError(f"{where}: expected offsets of cells that rise")
    return arrays.read(_named(part, "connectivity"), int(stops[-1])).astype(np.int64), counts
