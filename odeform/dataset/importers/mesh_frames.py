"""A folder of motions: a table of parameters, and for each row a folder of frames or a file with all of them.

The table, `parameters.csv`, has one row per sequence: a column `sequence` that names the subfolder or the file, and one
column per parameter, with its unit in brackets if it has one: `mass (kg)`. Columns `split` (train, val, test) and
`rate` (Hz, the same in all rows) are optional. `parameters.json` is a list of such rows as objects.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from unicodedata import normalize

from odeform.dataset.importers.convertible import convertible
from odeform.dataset.importers.frame_folder import visible
from odeform.dataset.importers.parameter_table import Row, find_table, has_table, read_rows
from odeform.dataset.importers.recording import Recording, common_rate, frames_at
from odeform.dataset.importers.sequence_files import LISTS, SEQUENCE_FILES, folder_recording
from odeform.dataset.importers.source import Source, SourceSequence
from odeform.errors import InputError

__all__ = ["has_table", "mesh_source"]

SHOWN = 5  # names in a note
PLAUSIBLE = (1.0, 1e5)  # Hz
Stored = Mapping[str, Sequence[Path]]


def mesh_source(root: Path, rate: float | None = None) -> Source:
    """All sequences of the table. `rate` in Hz overrides that of the table, and both the times of the files, at which
    frames are resampled. Raises `InputError` for any mistake in it, and without a table."""
    table = find_table(root)
    parsed = read_rows(table)
    stored = _stored(root)
    found = [(row, _place(row, stored, root, table)) for row in parsed.rows]
    recordings = {path.name if path.is_dir() else _stem(path): _recording(path) for _, path in found}
    if len(recordings) < len(found):
        raise InputError(f"import {table}: expected each sequence only once")
    rates = parsed.rates if rate is None else (rate,)
    if len(rates) > 1 or not all(0.0 < given < float("inf") for given in rates):
        got = ", ".join(f"{given:g}" for given in rates)
        raise InputError(f"import {table}: expected one rate in Hz, in a column 'rate' or by --rate, got {got}")
    used = rates[0] if rates else common_rate(recordings, f"import {table}")
    frames, notes = frames_at(used, recordings, bool(rates))
    sequences = tuple(
        SourceSequence(name, row.parameters, *frames[name], row.split, recordings[name].metric)
        for name, (row, _) in zip(recordings, found, strict=True)
    )
    if not rates and not PLAUSIBLE[0] <= used <= PLAUSIBLE[1]:
        notes = (*notes, f"the times make {used:g} frames per second: are they in seconds?")
    doubts = (*parsed.notes, *_left_out(stored, [path for _, path in found], recordings, root), *notes)
    made: dict[str, Any] = {"imported": root.name, "layout": "meshes"}
    return Source(f"imported-{root.name}", used, sequences, parsed.units, provenance=made, doubts=doubts)


def _stored(root: Path) -> Stored:
    """Lists what a row may name: folders, and files of sequences with and without their ending."""
    stored: dict[str, list[Path]] = {}
    for path in visible(root):
        if path.is_dir() or path.suffix.lower() in SEQUENCE_FILES:
            for name in {path.name, path.name if path.is_dir() else _stem(path)}:
                stored.setdefault(normalize("NFC", name), []).append(path)
    return stored


def _recording(path: Path) -> Recording:
    return folder_recording(path) if path.is_dir() else SEQUENCE_FILES[path.suffix.lower()](path)


def _stem(path: Path) -> str:
    """Without the ending, which may be one of two, as in a.vtu.series."""
    return path.with_suffix("").stem if path.suffix.lower() == ".series" else path.stem


def _place(row: Row, stored: Stored, root: Path, table: Path) -> Path:
    """The folder or file of a row; what lists frames comes before the folder of these frames."""
    found = list(stored.get(row.name, ()))
    lists = [path for path in found if path.suffix.lower() in LISTS]
    found = lists[:1] if lists else found
    if not found:
        near = [path for path in visible(root) if path.stem == row.name]
        hint = convertible([path.suffix.lower() for path in near])
        raise InputError(f"import {table}: {row.where}: sequence {row.name!r}: no such folder or file in {root}{hint}")
    if len(found) > 1:
        raise InputError(
            f"import {table}: {row.where}: expected one {row.name}, got {' and '.join(path.name for path in found)}"
        )
    return found[0]


def _left_out(stored: Stored, used: Sequence[Path], recordings: Mapping[str, Recording], root: Path) -> list[str]:
    """A note on folders and files that no row uses."""
    named = {path for paths in stored.values() if set(paths) & set(used) for path in paths}
    named |= {path for found in recordings.values() for file in found.listed for path in (file, *file.parents)}
    others = sorted({path.name for paths in stored.values() for path in paths if path not in named})
    if not others:
        return []
    more = f" and {len(others) - SHOWN} more" if len(others) > SHOWN else ""
    return [f"import {root}: without a row in the table, and left out: {', '.join(others[:SHOWN])}{more}"]
