"""The table of parameters next to a folder of motions."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unicodedata import normalize

from odeform.budget import read_limited
from odeform.dataset.importers.frame_folder import visible
from odeform.errors import InputError
from odeform.formats.delimited import parse_number, read_table, with_unit
from odeform.formats.encodings import decoded
from odeform.io import parse_json

__all__ = ["ParameterTable", "Row", "find_table", "has_table", "read_rows"]

LARGEST = 1 << 26  # bytes
TABLES = ("parameters.csv", "parameters.json", "parameters.tsv")
WORKBOOKS = ("parameters.xlsx", "parameters.xls", "parameters.ods", "parameters.numbers")
SEQUENCE, SPLIT, RATE = "sequence", "split", "rate"
SPLITS = ("train", "val", "test")
COUNTERS = ("index", "id", "no", "no.", "nr", "nr.", "row", "run")
"""Names of columns that more often number the rows than vary the motion."""
HERTZ = ("", "hz", "1/s", "fps")


@dataclass(frozen=True)
class Row:
    """One sequence: where its row is, its name, parameters by name, and split or nothing."""

    where: str
    name: str
    parameters: Mapping[str, float]
    split: str


@dataclass(frozen=True)
class ParameterTable:
    """All rows; units by parameter; the different rates in Hz; notes on how it was read."""

    rows: tuple[Row, ...]
    units: Mapping[str, str]
    rates: tuple[float, ...]
    notes: tuple[str, ...]


def has_table(root: Path) -> bool:
    """Whether a folder has a table of parameters, or a workbook in its place."""
    return any(path.name.lower() in (*TABLES, *WORKBOOKS) for path in visible(root) if path.is_file())


def find_table(root: Path) -> Path:
    """Finds the table in a folder, whatever the case of its name. Raises `InputError` for none, two, or a workbook."""
    files = [path for path in visible(root) if path.is_file()]
    found = [path for path in files if path.name.lower() in TABLES]
    if len(found) > 1:
        raise InputError(f"import {root}: expected one table, got {' and '.join(path.name for path in found)}")
    if not found:
        books = [path.name for path in files if path.name.lower() in WORKBOOKS]
        got = f", got {books[0]}: save it as CSV" if books else ""
        raise InputError(f"import {root}: expected {' or '.join(TABLES[:2])}{got}")
    return found[0]


def read_rows(table: Path) -> ParameterTable:
    """Reads the content of a table. Raises `InputError` that names the row for any mistake in it."""
    records, notes = _json_records(table) if table.suffix.lower() == ".json" else _csv_records(table)
    if not records or not all(SEQUENCE in record for _, record in records):
        raise InputError(f"import {table}: expected rows with a column {SEQUENCE!r}")
    units: dict[str, str] = {}
    rates: set[float] = set()
    rows = [_row(table, where, record, units, rates) for where, record in records]
    names = [row.name for row in rows]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InputError(f"import {table}: expected each sequence only once, got {twice[0]} twice")
    without = [row.name for row in rows if not row.split]
    if 0 < len(without) < len(rows):
        raise InputError(
            f"import {table}: expected a split for every sequence or for none, got none for {without[0]}"
            + (f" and {len(without) - 1} more" if len(without) > 1 else "")
        )
    counters = [name for name in rows[0].parameters if name.casefold() in COUNTERS]
    if counters:
        notes += (f"import {table}: the column {counters[0]!r} is taken as a parameter: leave it out if it is none",)
    return ParameterTable(tuple(rows), units, tuple(sorted(rates)), notes)


def _row(table: Path, line: str, record: Mapping[str, Any], units: dict[str, str], rates: set[float]) -> Row:
    name = normalize("NFC", str(record[SEQUENCE]).strip())
    if not name:
        raise InputError(f"import {table}: {line}: expected the name of a sequence, got an empty cell")
    where = f"import {table}: {line}: {name}"
    split, parameters = "", {}
    for column, value in record.items():
        parameter, unit = with_unit(str(column))
        if not parameter:
            raise InputError(f"import {table}: column {column!r} has a unit, but no name")
        reserved = parameter.casefold() if parameter.casefold() in (SEQUENCE, SPLIT, RATE) else ""
        if reserved == SPLIT:
            split = str(value or "").strip().lower()
            if split not in ("", *SPLITS):
                raise InputError(f"{where}: split: expected {', '.join(SPLITS)}, got {value!r}")
        elif reserved == RATE:
            if unit.casefold() not in HERTZ:
                raise InputError(f"import {table}: column {column!r}: expected a rate in Hz")
            rates |= set() if value in (None, "") else {_number(value, f"{where}: {column}")}
        elif not reserved:
            if parameter in parameters:
                raise InputError(f"import {table}: two columns of the parameter {parameter!r}")
            units[parameter] = unit
            parameters[parameter] = _number(value, f"{where}: {column}")
    return Row(line, name, parameters, split)


def _csv_records(table: Path) -> tuple[list[tuple[str, Mapping[str, Any]]], tuple[str, ...]]:
    read = read_table(table, f"import {table}", SEQUENCE)
    return [(f"line {line}", row) for line, row in zip(read.lines, read.rows, strict=True)], read.notes


def _json_records(table: Path) -> tuple[list[tuple[str, Mapping[str, Any]]], tuple[str, ...]]:
    where = f"import {table}"
    try:
        text, notes = decoded(read_limited(table, where, LARGEST), where)
    except OSError as error:
        raise InputError(f"{where}: cannot be read: {error.strerror}") from None
    rows = parse_json(text, where)
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError(f"{where}: expected a list of objects, one per sequence")
    return [(f"row {number}", row) for number, row in enumerate(rows, start=1)], notes


def _number(value: Any, where: str) -> float:
    if isinstance(value, str):
        return parse_number(value, where)
    try:
        if isinstance(value, bool):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{where}: expected a number, got {value!r}") from None
