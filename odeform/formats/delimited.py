"""Tables of text as programs and people write them: CSV of any locale, from spreadsheets, pandas, R or by hand.

Cells are separated by commas, semicolons, tabs or bars, whichever the header uses; a first line `sep=;` says so itself.
Blank rows, empty cells at the end of rows, spaces around cells, lines of comment (#, % or //) and a column that only
numbers the rows are left out. Numbers have a decimal point, or a decimal comma where cells are not separated by commas.
"""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from odeform.budget import read_limited
from odeform.errors import InputError
from odeform.formats.encodings import decoded

__all__ = ["Table", "parse_number", "read_table", "with_unit"]

LARGEST = 1 << 26  # bytes
SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars"}
COMMENT = re.compile(r"\s*(?:#|%|//)")
SEPARATOR_LINE = re.compile(r'\s*"?sep=(.)"?\s*', re.IGNORECASE)
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
COMMA_NUMBER = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?", re.ASCII)
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}", re.ASCII)
INDEX = ("", "Unnamed: 0", "#")
"""Names of a first column that numbers the rows."""
UNIT = re.compile(r"(.*?)\s*(?:\(([^()]*)\)?|\[([^\[\]]*)\]?)")

Rows = list[tuple[int, list[str]]]
"""The number of each row's line, from 1, and its cells."""


@dataclass(frozen=True)
class Table:
    """A header and rows of as many cells, without spaces around them.

    Attributes:
        header: The names of the columns; all differ, none is empty.
        rows: The cells by column.
        lines: The line of each row in the file, from 1.
        notes: What had to be guessed or was left out, in sentences that name the file.
    """

    header: tuple[str, ...]
    rows: tuple[dict[str, str], ...]
    lines: tuple[int, ...]
    notes: tuple[str, ...]


def read_table(path: Path, where: str, key: str) -> Table:
    """The table in a file, whose header has a column `key` (in any case; it is renamed to that).

    Decimal commas in cells become points. Raises `InputError`, which `where` leads, in one line that names the line.
    """
    try:
        text, notes = decoded(read_limited(path, where, LARGEST), where)
    except OSError as error:
        raise InputError(f"{where}: cannot be read: {error.strerror}") from None
    lines = text.rstrip("\x1a").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    first = next((index for index, line in enumerate(lines) if line.strip(" \t,;|")), 0)
    separator = ""
    if lines and (stated := SEPARATOR_LINE.fullmatch(lines[first])):
        separator, lines[first] = stated[1], ""
    lines = _without_comments(lines, key)
    separator, rows = _split(lines, separator, where, key)
    header, rows, left_out = _columns(rows, separator, where, key)
    if separator != ",":
        rows, guessed = _with_points(rows, header.index(key), where)
        left_out += guessed
    records = tuple(dict(zip(header, cells, strict=True)) for _, cells in rows)
    return Table(tuple(header), records, tuple(line for line, _ in rows), notes + left_out)


def parse_number(cell: str, where: str) -> float:
    """Parses the number in a cell, as plain text with a decimal point. Raises `InputError`, which `where` leads."""
    if not NUMBER.fullmatch(cell):
        comma = ": with commas between cells, decimals need a point" if COMMA_NUMBER.fullmatch(cell) else ""
        raise InputError(f"{where}: expected a number, got {cell!r}{comma}")
    return float(cell)


def with_unit(column: str) -> tuple[str, str]:
    """The name and the unit of a column such as `mass (kg)` or `mass [kg]`; the unit is empty if it has none."""
    found = UNIT.fullmatch(column)
    return (found[1].strip(), (found[2] or found[3] or "").strip()) if found else (column, "")


def _without_comments(lines: list[str], key: str) -> list[str]:
    """The same lines, empty where they are comments; a header behind the sign of a comment loses the sign."""
    comments = [bool(COMMENT.match(line)) for line in lines]
    plain = next((line for line, comment in zip(lines, comments, strict=True) if line.strip() and not comment), "")
    if key not in plain.casefold():
        for index, line in enumerate(lines):
            bare = COMMENT.sub("", line, count=1)
            if comments[index] and re.match(rf'[\s,;|]*"?{key}"?\s*[,;\t|]', bare.casefold()):
                numbers_rows = bare[:1] in SEPARATORS  # `#` is the name of a column
                comments[index], lines[index] = False, line if numbers_rows else bare
                break
    return ["" if comment else line for line, comment in zip(lines, comments, strict=True)]


def _split(lines: list[str], stated: str, where: str, key: str) -> tuple[str, Rows]:
    """The separator, and the rows that are not blank, the header first."""
    tried: Rows = []
    broken: InputError | None = None
    for separator in (stated,) if stated else SEPARATORS:
        try:
            rows = _cells(lines, separator, where)
        except InputError as error:
            broken = broken or error
            continue
        if rows and any(cell.casefold() == key for cell in rows[0][1]) and (stated or len(rows[0][1]) > 1):
            return separator, rows
        tried = max(tried, rows[:1], key=lambda rows: len(rows[0][1]) if rows else 0)
    if broken:
        raise broken
    if not tried:
        raise InputError(f"{where}: expected a header with a column {key!r}, got an empty table")
    got = ", ".join(repr(cell) for cell in tried[0][1][:5])
    between = f"{stated!r}, as `sep=` says" if stated else "commas, semicolons, tabs or bars"
    raise InputError(f"{where}: line {tried[0][0]}: expected a column {key!r}, with {between} between cells, got {got}")


def _cells(lines: list[str], separator: str, where: str) -> Rows:
    text = re.sub(rf'(?<=") +(?={re.escape(separator)}|$)', "", "\n".join(lines), flags=re.MULTILINE)
    reader = csv.reader(io.StringIO(text), delimiter=separator, skipinitialspace=separator != "\t", strict=True)
    rows: Rows = []
    try:
        for cells in reader:
            stripped = [" ".join(cell.split()) for cell in cells]
            if any(stripped):
                rows.append((reader.line_num, stripped))
    except csv.Error as error:
        raise InputError(f"{where}: line {reader.line_num}: {error}: is a quotation mark missing?") from None
    return rows


def _columns(rows: Rows, separator: str, where: str, key: str) -> tuple[list[str], Rows, tuple[str, ...]]:
    """Header and rows of the same length, without empty columns at the end and without a column of row numbers."""
    line, header = rows[0]
    header = [key if cell.casefold() == key else cell for cell in _trimmed(header, 1)]
    body = [(number, _trimmed(cells, len(header))) for number, cells in rows[1:]]
    for number, cells in body:
        if len(cells) != len(header):
            hint = ": are there decimal commas? Separate cells by semicolons, or write decimal points"
            raise InputError(
                f"{where}: line {number}: expected {len(header)} cells between {SEPARATORS.get(separator, separator)} "
                f"as in the header, got {len(cells)}{hint if separator == ',' and len(cells) > len(header) else ''}"
            )
    notes: tuple[str, ...] = ()
    if header[0] in INDEX and _numbers_rows([cells[0] for _, cells in body]):
        name = f"{header[0]!r}" if header[0] else "without a name"
        header, body = header[1:], [(number, cells[1:]) for number, cells in body]
        notes = (f"{where}: the first column, {name}, numbers the rows and is left out",)
    empty = [index for index, name in enumerate(header) if not name and not any(cells[index] for _, cells in body)]
    header, body = _without(header, empty), [(number, _without(cells, empty)) for number, cells in body]
    if "" in header:
        raise InputError(f"{where}: line {line}: column {header.index('') + 1} has no name")
    if doubled := [name for name in header if header.count(name) > 1]:
        raise InputError(f"{where}: line {line}: two columns {doubled[0]!r}")
    return header, body, notes


def _without(cells: list[str], columns: list[int]) -> list[str]:
    return [cell for index, cell in enumerate(cells) if index not in columns] if columns else cells


def _trimmed(cells: list[str], least: int) -> list[str]:
    """Without empty cells at the end, beyond the first `least`."""
    while len(cells) > least and not cells[-1]:
        cells = cells[:-1]
    return cells


def _numbers_rows(cells: Sequence[str]) -> bool:
    return any(list(cells) == [str(start + index) for index in range(len(cells))] for start in (0, 1))


def _with_points(rows: Rows, name: int, where: str) -> tuple[Rows, tuple[str, ...]]:
    """Rows with decimal points for decimal commas, but in the column of names; a note if all may group thousands."""
    cells = [cell for _, cells in rows for index, cell in enumerate(cells) if index != name]
    commas = [cell for cell in cells if COMMA_NUMBER.fullmatch(cell)]
    points = [cell for cell in cells if "." in cell and NUMBER.fullmatch(cell)]
    if commas and points:
        raise InputError(f"{where}: expected decimal points or decimal commas, got both: {points[0]} and {commas[0]}")
    pointed = [
        (line, [cell if index == name else _pointed(cell) for index, cell in enumerate(cells)]) for line, cells in rows
    ]
    decimals = commas or points
    doubtful = bool(decimals) and all(map(THOUSANDS.fullmatch, decimals))
    return pointed, (f"{where}: {decimals[0]} is read as a decimal, not as thousands",) if doubtful else ()


def _pointed(cell: str) -> str:
    return cell.replace(",", ".") if COMMA_NUMBER.fullmatch(cell) else cell
