"""A sequence in one file, or behind one file that lists its frames, as a recording."""

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from odeform.budget import MEMORY, read_limited
from odeform.dataset.importers.even_steps import even_step
from odeform.dataset.importers.frame_folder import frame_folder, recorded_files, visible
from odeform.dataset.importers.frame_reading import DISPLACEMENT, VTK
from odeform.dataset.importers.recording import Recording
from odeform.dataset.importers.unpacking import Unpacked
from odeform.dataset.motion_arrays import read_motion_arrays
from odeform.errors import InputError, counted
from odeform.formats.motion_capture import read_c3d
from odeform.formats.vtk_files import read_grid
from odeform.formats.vtk_grid import Grid, outside_of
from odeform.formats.vtk_xml import parsed_xml
from odeform.io import parse_json
from odeform.types import Faces, Frames, Mesh

__all__ = ["LISTS", "SEQUENCE_FILES", "folder_recording"]

LARGEST_LIST = 1 << 24  # bytes
LISTS = (".pvd", ".series")
"""Endings of files that list frames and their times."""
NO_FACES = np.zeros((0, 3), np.int32)


def folder_recording(folder: Path) -> Recording:
    """The frames in a folder; a list of ParaView among them says their times. Raises `InputError` for several."""
    lists = [path for path in visible(folder) if path.suffix.lower() in LISTS]
    if len(lists) > 1:
        names = " and ".join(path.name for path in lists[:3])
        raise InputError(f"import {folder}: expected one sequence, got the lists {names}")
    return listed_frames(lists[0]) if lists else frame_folder(folder)


def npz_recording(path: Path) -> Recording:
    """Reads vertices (T, N, 3), perhaps times (T,) s and faces (F, 3), in an `.npz` file."""
    where = f"import {path}"
    motion = read_motion_arrays(_content(path, MEMORY // 4), where)

    def read() -> tuple[Frames, Faces]:
        again = read_motion_arrays(_content(path, MEMORY // 4), where)
        return again.vertices, NO_FACES if again.faces is None else _checked(
            again.faces, again.vertices.shape[1], where
        )

    notes = (f"arrays left out: {', '.join(motion.unused[:8])}",) if motion.unused else ()
    return Recording(where, len(motion.vertices), read, motion.times, motion.counted, notes=notes)


def c3d_recording(path: Path) -> Recording:
    """Reads the markers of a C3D file, as points without faces."""
    where = f"import {path}"
    capture = read_c3d(_content(path, MEMORY // 4), where)
    notes = (*capture.notes, f"{counted(len(capture.labels), 'marker')} as points: {', '.join(capture.labels[:8])}"
             f"{' …' if len(capture.labels) > 8 else ''}")  # fmt: skip
    return Recording(
        where, len(capture.times), lambda: (capture.points, NO_FACES), capture.times, metric=True, notes=notes
    )


def zip_recording(path: Path) -> Recording:
    """Reads the frames in a zipped folder."""
    archive = Unpacked(path)
    with archive.named():
        found = folder_recording(archive.root)

    def read() -> tuple[Frames, Faces]:
        with archive.named():
            return found.read()

    notes = tuple(map(archive.renamed, found.notes))
    return replace(found, where=f"import {path}", read=read, notes=notes)


def vtk_recording(path: Path) -> Recording:
    """Reads one file of VTK with a field of displacements for each frame: displacement0, displacement1, ..."""
    where = f"import {path}"
    grid = read_grid(path, where)
    numbered = {}
    for name in grid.vectors:
        stem, digits = re.fullmatch(r"(.*?)[_.@ ]*(\d{0,15})", name, re.DOTALL).groups()  # pyright: ignore[reportOptionalMemberAccess]
        if digits and DISPLACEMENT.search(stem):
            numbered.setdefault(stem, {})[int(digits)] = name
    if len(numbered) != 1:
        raise InputError(
            f"{where}: expected one frame a file, in a folder, or fields of displacements numbered 0, 1, ..., got "
            f"{', '.join(grid.vectors) or 'no field of vectors'}"
        )
    ((_, found),) = numbered.items()
    order = sorted(found)
    fields = [found[number] for number in order]
    step = even_step(np.array(order, float) - order[0], where, fields, decimal=False, first=float(order[0]))

    def read() -> tuple[Frames, Faces]:
        meshes = [
            outside_of(Grid(grid.points + grid.vectors[name], grid.connectivity, grid.offsets, grid.types), where)
            for name in fields
        ]
        if not isinstance(meshes[0], Mesh):
            raise InputError(f"{where}: expected a mesh, got points without faces")
        return np.stack([mesh.points for mesh in meshes]), meshes[0].faces

    note = f"the frames are the points displaced by {fields[0]} to {fields[-1]}"
    return Recording(where, len(fields), read, step=step, notes=(note,))


def listed_frames(path: Path) -> Recording:
    """Reads the frames that a `.pvd` or `.series` file of ParaView lists, with their times."""
    where = f"import {path}"
    data = _content(path, LARGEST_LIST)
    listed = _collection(data, where) if path.suffix.lower() == LISTS[0] else _series(data, where)
    if len(listed) < 2:
        raise InputError(f"{where}: expected at least 2 frames, got {len(listed)}")
    listed.sort()
    times = np.array([time for time, _ in listed])
    for (one, first), (two, second) in pairwise(listed):
        if one == two:
            raise InputError(f"{where}: expected one file for each time, got {first} and {second} at {one:g}")
    files = [_inside(path, name, where) for _, name in listed]
    found = recorded_files(files, where, times, counted=bool((times == np.round(times)).all()))
    return replace(found, listed=tuple(files))


def _collection(data: bytes, where: str) -> list[tuple[float, str]]:
    """Time and file of each entry of a `.pvd` file."""
    entries = parsed_xml(data, where).findall("Collection/DataSet")
    if any(entry.get("part", "0") != "0" for entry in entries):
        raise InputError(f"{where}: expected one part at each time, got several: merge them, or save one .vtu a frame")
    return [(_time(entry.get("timestep", ""), where), entry.get("file", "")) for entry in entries]


def _series(data: bytes, where: str) -> list[tuple[float, str]]:
    content = parse_json(data, where)
    files = content.get("files") if isinstance(content, dict) else None
    if not isinstance(files, list) or not all(isinstance(entry, dict) for entry in files):
        raise InputError(f"{where}: expected a JSON object with a list of files, each with name and time")
    return [(_time(str(entry.get("time", "")), where), str(entry.get("name", ""))) for entry in files]


def _time(text: str, where: str) -> float:
    try:
        time = float(text)
    except ValueError:
        time = float("nan")
    if not np.isfinite(time):
        raise InputError(f"{where}: expected a time for each file, got {text!r}")
    return time


def _inside(listing: Path, name: str, where: str) -> Path:
    """The file that a listing names, in its folder or below."""
    path = listing.parent / name.replace("\\", "/")
    if "\0" in name or not path.resolve().is_relative_to(listing.parent.resolve()):
        raise InputError(f"{where}: expected files below its folder, got {name}")
    if path.suffix.lower() not in VTK:
        raise InputError(f"{where}: expected files that end in {', '.join(VTK)}, got {name or 'an empty name'}")
    if not path.is_file():
        raise InputError(f"{where}: no file {name}")
    return path


def _checked(faces: Faces, count: int, where: str) -> Faces:
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise InputError(f"{where}: expected faces (F, 3) of integers, got {faces.dtype} {faces.shape}")
    if faces.min(initial=0) < 0 or faces.max(initial=0) >= count:
        raise InputError(
            f"{where}: faces refer to vertices that do not exist: {faces.max()} of {count}, counted from 0"
        )
    return faces.astype(np.int32)


def _content(path: Path, most: int) -> bytes:
    try:
        return read_limited(path, f"import {path}", most)
    except OSError as error:
        raise InputError(f"import {path}: cannot be read: {error.strerror}") from None


SEQUENCE_FILES: dict[str, Callable[[Path], Recording]] = {
    **dict.fromkeys(LISTS, listed_frames),
    ".npz": npz_recording,
    ".c3d": c3d_recording,
    ".zip": zip_recording,
    **dict.fromkeys(VTK, vtk_recording),
}
"""Ending -> reader; those that list frames come first."""
