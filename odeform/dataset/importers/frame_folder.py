"""The frames in the folder of one sequence, one file each, as a recording."""

import functools
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from odeform.dataset.importers.convertible import convertible
from odeform.dataset.importers.frame_names import numbered_frames
from odeform.dataset.importers.frame_reading import VTK, displacement_field, read_displaced, read_frames
from odeform.dataset.importers.recording import Recording
from odeform.errors import InputError
from odeform.formats.delimited import parse_number, read_table, with_unit
from odeform.formats.reading import read_geometry
from odeform.types import Times

__all__ = ["ENDINGS", "frame_folder", "recorded_files", "visible"]

ENDINGS = (".obj", ".ply", ".stl", ".off", *VTK)
TIMES = "times.csv"
SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}


def frame_folder(folder: Path) -> Recording:
    """The frames in a folder, in their order. Raises `InputError` for folders whose frames or order are not certain."""
    where = f"import {folder}"
    files = _frames(folder, where)
    if (folder / TIMES).is_file():
        ordered, times = _listed(folder / TIMES, files)
        return recorded_files(ordered, where, times)
    numbered = numbered_frames(files, where)
    recording = recorded_files(numbered.files, where)
    return Recording(
        where, len(files), recording.read, step=numbered.step, decimal=numbered.decimal, notes=recording.notes
    )


def recorded_files(files: Sequence[Path], where: str, times: Times | None = None, counted: bool = False) -> Recording:
    """Returns files in their order, of VTK perhaps with points that a field displaces."""
    field = displacement_field(files, where) if files[0].suffix.lower() in VTK and len(files) > 1 else ""
    notes = _left_out(files[0])
    if field:
        read = functools.partial(read_displaced, files, field)
        notes = (f"the points stand still; they are displaced by the field {field}", *notes)
        return Recording(where, len(files), read, times, counted, notes=notes)
    return Recording(where, len(files), functools.partial(read_frames, files), times, counted, notes=notes)


def _left_out(file: Path) -> tuple[str, ...]:
    """Notes on what a frame has beside its mesh; none of a damaged one, which is refused where all are read."""
    try:
        return read_geometry(file, merge=False).notes
    except InputError:
        return ()


def visible(folder: Path) -> list[Path]:
    """Lists a folder by name, without hidden files and what systems leave behind (`__MACOSX`)."""
    try:
        return sorted(path for path in folder.iterdir() if not path.name.startswith((".", "__MACOSX")))
    except OSError as error:
        raise InputError(f"import {folder}: cannot be read: {error.strerror}") from None


def _frames(folder: Path, where: str) -> list[Path]:
    """The files of frames. Raises `InputError` where they have several endings, or are in subfolders too."""
    inside = visible(folder)
    files = [path for path in inside if path.suffix.lower() in ENDINGS and path.is_file()]
    kinds = Counter(path.suffix.lower() for path in files)
    nested = [path for path in inside if path.is_dir() and _has_frames(path)]
    if not files:
        others = Counter(path.suffix.lower() for path in inside if path.is_file() and path.suffix)
        found = ", ".join(f"{count} {ending}" for ending, count in others.most_common(4))
        found = found or (f"folders {nested[0].name} ..." if nested else "none")
        raise InputError(
            f"{where}: expected frames, one file each ({' '.join(ENDINGS)}), found {found}{convertible(list(others))}"
        )
    if len(kinds) > 1:
        examples = [next(path.name for path in files if path.suffix.lower() == kind) for kind in kinds]
        raise InputError(
            f"{where}: expected frames of one ending, got "
            + " and ".join(f"{kinds[kind]} {kind} ({name})" for kind, name in zip(kinds, examples, strict=True))
        )
    if nested:
        raise InputError(
            f"{where}: expected one sequence, got frames in the folder, such as {files[0].name}, and in its folder "
            f"{nested[0].name}"
        )
    return files


def _has_frames(folder: Path) -> bool:
    return any(path.suffix.lower() in ENDINGS for path in visible(folder))


def _listed(table: Path, files: Sequence[Path]) -> tuple[list[Path], Times]:
    """The frames in the order of their times in seconds, from a table with columns `file` and `time`."""
    where = f"import {table}"
    rows = read_table(table, where, "file")
    column = next((name for name in rows.header if with_unit(name)[0].casefold() in ("time", "times", "t")), None)
    if column is None or with_unit(column)[1] not in SECONDS:
        raise InputError(f"{where}: expected a column 'time' in s, ms or us, got {', '.join(rows.header)}")
    names = {name: path for path in files for name in (path.name, path.stem)}
    found: dict[Path, float] = {}
    for row, line in zip(rows.rows, rows.lines, strict=True):
        path = names.get(row["file"])
        if path is None:
            raise InputError(f"{where}: line {line}: no file {row['file']!r} in the folder")
        if path in found:
            raise InputError(f"{where}: line {line}: {path.name} is listed twice")
        found[path] = SECONDS[with_unit(column)[1]] * parse_number(row[column], f"{where}: line {line}: {column}")
    if missing := [path.name for path in files if path not in found]:
        raise InputError(f"{where}: expected a time for each frame, got none for {missing[0]}")
    ordered = sorted(found, key=lambda path: found[path])
    return ordered, np.array([found[path] for path in ordered])
