"""A folder of mesh frames: one subfolder per sequence with its frames as .obj or .ply, and a table of parameters.

The table, `parameters.csv`, has one row per sequence: a column `sequence` that names the subfolder, and one column per
parameter, with its unit in brackets if it has one: `mass (kg)`. Columns `split` (train, val, test) and `rate` (Hz, the
same in all rows) are optional. `parameters.json` is a list of such rows as objects.
"""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from odeform.budget import read_limited
from odeform.dataset.importers.natural_order import naturally_sorted, subfolders
from odeform.dataset.importers.source import Source, SourceSequence
from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.io import parse_json
from odeform.types import Faces, Frames, Mesh

__all__ = ["has_table", "mesh_source"]

LARGEST = 1 << 26  # bytes of a table
ENDINGS = (".obj", ".ply")
TABLES = ("parameters.csv", "parameters.json")
SEQUENCE, SPLIT, RATE = "sequence", "split", "rate"
SPLITS = ("train", "val", "test")

Row = Mapping[Any, Any]


def has_table(root: Path) -> bool:
    """Whether a folder has a table of parameters."""
    return _table(root) is not None


def mesh_source(root: Path, rate: float | None = None) -> Source:
    """All sequences of the table. `rate` in Hz overrides that of the table. Raises `InputError` for any mistake in it,
    and without a table."""
    table = _table(root)
    if table is None:
        raise InputError(f"import {root}: expected {' or '.join(TABLES)}")
    rows = _rows(table)
    folders = {folder.name: folder for folder in subfolders(root)}
    sequences, units = [], {}
    for row in rows:
        name = str(row.get(SEQUENCE, ""))
        if name not in folders:
            raise InputError(f"import {table}: sequence {name!r}: no such folder in {root}")
        split = str(row.get(SPLIT) or "")
        if split not in ("", *SPLITS):
            raise InputError(f"import {table}: {name}: split: expected {', '.join(SPLITS)}, got {split!r}")
        parameters = {}
        for column, value in row.items():
            if column not in (SEQUENCE, SPLIT, RATE):
                parameter, _, unit = column.partition("(")
                parameter = parameter.strip()
                if parameter in parameters:
                    raise InputError(f"import {table}: two columns of the parameter {parameter!r}")
                units[parameter] = unit.rstrip(") ")
                parameters[parameter] = _number(value, f"import {table}: {name}: {column}")
        files = naturally_sorted(path for path in folders[name].iterdir() if path.suffix.lower() in ENDINGS)
        sequences.append(SourceSequence(name, parameters, len(files), lambda files=files: _read(files), split))
    if len({found.name for found in sequences}) != len(sequences):
        raise InputError(f"import {table}: expected each sequence only once")
    without = [found.name for found in sequences if not found.split]
    if 0 < len(without) < len(sequences):
        raise InputError(
            f"import {table}: expected a split for every sequence or for none, got none for {without[0]}"
            + (f" and {len(without) - 1} more" if len(without) > 1 else "")
        )
    made = {"imported": root.name, "layout": "meshes"}
    return Source(f"imported-{root.name}", _rate(rows, table, rate), tuple(sequences), units, provenance=made)


def _table(root: Path) -> Path | None:
    return next((root / name for name in TABLES if (root / name).is_file()), None)


def _rows(table: Path) -> list[Row]:
    try:
        text = read_limited(table, f"import {table}", LARGEST).decode("utf-8-sig")
        if table.suffix == ".json":
            rows = parse_json(text, f"import {table}")
            if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
                raise ValueError("expected a list of objects, one per sequence")
        else:
            reader = csv.DictReader(text.splitlines(), skipinitialspace=True, strict=True)
            names = list(reader.fieldnames or ())
            if doubled := [name for name in names if names.count(name) > 1]:
                raise ValueError(f"two columns {doubled[0]!r}")
            rows: list[Row] = [*reader]
            if any(None in row or None in row.values() for row in rows):
                raise ValueError("expected the same number of cells in every row")
    except InputError:
        raise
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"import {table}: cannot be read: {error}") from None
    if not rows or not all(SEQUENCE in row for row in rows):
        raise InputError(f"import {table}: expected rows with a column {SEQUENCE!r}")
    return rows


def _rate(rows: list[Row], table: Path, given: float | None) -> float:
    rates = {_number(row[RATE], f"import {table}: {RATE}") for row in rows if row.get(RATE) not in (None, "")}
    if given is not None:
        rates = {given}
    if len(rates) != 1 or not 0.0 < min(rates) < float("inf"):
        raise InputError(
            f"import {table}: expected one rate in Hz, in a column {RATE!r} or by --rate, got {sorted(rates) or 'none'}"
        )
    return rates.pop()


def _number(value: Any, where: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{where}: expected a number, got {value!r}") from None


def _read(files: list[Path]) -> tuple[Frames, Faces]:
    meshes = []
    for file in files:
        mesh = read_geometry(file, merge=False)
        if not isinstance(mesh, Mesh):
            raise InputError(f"import {file}: expected a mesh, got points")
        if meshes and (mesh.points.shape != meshes[0].points.shape or not np.array_equal(mesh.faces, meshes[0].faces)):
            raise InputError(f"import {file}: expected the same mesh as in {files[0].name}")
        meshes.append(mesh)
    return np.stack([mesh.points for mesh in meshes]), meshes[0].faces
