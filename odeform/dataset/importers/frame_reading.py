"""The frames of one sequence, read from one mesh file each: the same vertices and faces in all."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.formats.vtk_files import read_grid
from odeform.formats.vtk_grid import Grid, outside_of
from odeform.geometry.coincidence import equal_rows
from odeform.types import Faces, Floats, Frames, Geometry, Mesh

__all__ = ["VTK", "displacement_field", "read_displaced", "read_frames"]

VTK = (".vtk", ".vtu", ".vtp")
APART = 0.1  # of the vertices: where more come apart, the triangles of a later STL file are in another order
DISPLACEMENT = re.compile(r"displ|^u$|^disp", re.IGNORECASE)
COPIES = 3  # of the frames while they are read


def read_frames(files: Sequence[Path]) -> tuple[Frames, Faces]:
    """(T, N, 3) and (F, 3) of T files. Raises `InputError` where a file has another mesh than the first.

    The triangles of STL files have corners of their own; those that coincide in all frames become one vertex.
    """
    first = _mesh(files[0], read_geometry(files[0], merge=False))
    points = first.points
    require_memory(f"import {files[0].parent}", f"{len(files):,} frames", COPIES * len(files) * points.nbytes)
    frames = np.empty((len(files), *points.shape), points.dtype)
    frames[0] = points
    for index, file in enumerate(files[1:], start=1):
        mesh = _mesh(file, read_geometry(file, merge=False))
        _require_same(mesh, first, file, files[0])
        frames[index] = mesh.points
    return _welded(frames, files) if files[0].suffix.lower() == ".stl" else (frames, first.faces)


def displacement_field(files: Sequence[Path], where: str) -> str:
    """The name of the field of vectors that moves the points of VTK files, where the points themselves do not move."""
    one, two = (read_grid(file, f"{where}/{file.name}") for file in files[:2])
    names = [name for name in one.vectors if DISPLACEMENT.search(name) and name in two.vectors]
    if not names or one.points.shape != two.points.shape or not np.array_equal(one.points, two.points):
        return ""
    if len(names) > 1:
        raise InputError(f"{where}: expected one field of displacements, got {', '.join(names)}")
    return names[0]


def read_displaced(files: Sequence[Path], field: str) -> tuple[Frames, Faces]:
    """Reads frames from files of VTK whose points stand still and are displaced by a field of vectors."""
    frames, first, faces = [], None, None
    for file in files:
        grid = read_grid(file, f"import {file}")
        if field not in grid.vectors:
            raise InputError(f"import {file}: expected the field {field} of vectors, as in {files[0].name}")
        if first is not None and not np.array_equal(grid.points, first.points):
            raise InputError(f"import {file}: expected points that stand still, as {field} displaces them")
        moved = Grid(grid.points + grid.vectors[field], grid.connectivity, grid.offsets, grid.types)
        mesh = _mesh(file, outside_of(moved, f"import {file}"))
        if faces is not None and not np.array_equal(mesh.faces, faces):
            raise InputError(f"import {file}: expected the same mesh as in {files[0].name}")
        first, faces = first or grid, mesh.faces
        frames.append(mesh.points)
    assert faces is not None
    return np.stack(frames), faces


def _mesh(file: Path, geometry: Geometry) -> Mesh:
    if not isinstance(geometry, Mesh):
        raise InputError(f"import {file}: expected a mesh, got points without faces")
    return geometry


def _require_same(mesh: Mesh, first: Mesh, file: Path, file0: Path) -> None:
    if mesh.points.shape != first.points.shape or mesh.faces.shape != first.faces.shape:
        raise InputError(
            f"import {file}: expected the same mesh as in {file0.name}, of {len(first.points)} vertices and "
            f"{len(first.faces)} faces, got {len(mesh.points)} and {len(mesh.faces)}"
        )
    if not np.array_equal(mesh.faces, first.faces):
        raise InputError(
            f"import {file}: expected the same mesh as in {file0.name}, got faces between other vertices: export "
            "without changing the order of vertices"
        )


def _welded(frames: Floats, files: Sequence[Path]) -> tuple[Frames, Faces]:
    """One vertex for the corners of triangles that coincide in all frames."""
    representatives, labels = equal_rows(frames[0])
    count = len(representatives)
    for frame, file in zip(frames[1:], files[1:], strict=True):
        if np.array_equal(frame, frame[representatives][labels]):
            continue
        representatives, labels = equal_rows(np.column_stack([labels.astype(float), frame]))
        if len(representatives) > (1.0 + APART) * count:
            raise InputError(
                f"import {file}: expected the triangles of {files[0].name} in their order, got others: corners that "
                "meet there are apart here; export as .ply or .obj, which keep vertices"
            )
    return frames[:, representatives], labels.reshape(-1, 3).astype(np.int32)
