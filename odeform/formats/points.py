"""Point clouds as text: .xyz, .txt, .csv, .asc and .pts, with the habits of many programs."""

import warnings
from pathlib import Path

import numpy as np

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.formats.point_layout import Layout, find_layout
from odeform.formats.text import numbers_of, read_text, words_per_line
from odeform.types import Floats, PointCloud

__all__ = ["read_xyz"]

BYTES_PER_BYTE = 8  # of memory while reading: a number may have one digit


def read_xyz(path: Path, merge: bool) -> PointCloud:
    """Points, one per line: x, y and z lead, unless a line of names says where they are. Points are never merged.

    Columns are separated by spaces, tabs, commas or semicolons; decimal commas are read where semicolons or tabs
    separate. A count of the points may come first, as in .pts. Red, green and blue are read where they are named, or
    where three whole numbers up to 255 follow, also behind an intensity.

    Raises:
        InputError: For fewer than three columns, lines of different lengths, words, and missing lines.
    """
    where, size = f"geometry {path}", path.stat().st_size
    require_memory(where, f"{size:,} bytes of text", BYTES_PER_BYTE * size)
    plain = _plain(path)
    if plain is not None:
        return _cloud(plain, Layout(), [])
    text = read_text(path)
    layout = find_layout(text, where)
    rows, lines = layout.rows(text)
    counts = words_per_line(rows)
    expected = len(layout.names) or int(counts[0])
    if expected < 3:
        raise InputError(f"{where}: line {lines[0]}: expected three numbers x y z in each line, got {expected}")
    values = numbers_of(rows, where, lines)
    if (counts != expected).any():
        odd = int(np.argmax(counts != expected))
        cut = ": truncated?" if odd == len(counts) - 1 and counts[odd] < expected else ""
        if layout.separator == b"," and counts[odd] > expected:
            cut = ": are there decimal commas? Separate columns by semicolons, or write decimal points"
        raise InputError(
            f"{where}: line {lines[odd]}: expected {expected} numbers as in line {lines[0]}, got {counts[odd]}{cut}"
        )
    if layout.count not in (None, len(counts)):
        raise InputError(
            f"{where}: expected {layout.count} points as its first line says, got {len(counts)}: truncated?"
        )
    return _cloud(values.reshape(-1, expected), layout, [])


def _plain(path: Path) -> Floats | None:
    """The numbers of a file of nothing else, quickly; None for every other one."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of an empty file
            table = np.loadtxt(path, ndmin=2)
    except (ValueError, UserWarning, UnicodeError):
        return None
    # a file of one count and no points, or of too few columns, is described where the layout is known
    return table if table.shape[1] >= 3 else None


def _cloud(table: Floats, layout: Layout, notes: list[str]) -> PointCloud:
    names = layout.names
    places = [names.index(name) for name in "xyz"] if names else slice(3)
    colors = (
        [names.index(name) for name in ("red", "green", "blue")] if "red" in names else _unnamed_colors(table, names)
    )
    painted = None
    if colors:
        values = np.nan_to_num(table[:, colors])
        top = 1.0 if values.max(initial=0.0) <= 1.0 else 255.0 if values.max() <= 255.0 else 65535.0
        painted = np.round(255.0 / top * np.clip(values, 0.0, top)).astype(np.uint8)
    others = table.shape[1] - 3 - len(colors)
    if others:
        notes.append(f"{others} further columns left out")
    return PointCloud(np.ascontiguousarray(table[:, places]), painted, tuple(notes))


def _unnamed_colors(table: Floats, names: tuple[str, ...]) -> list[int]:
    """The columns of whole numbers up to 255, not all 0 or 1, behind the positions, or behind an intensity."""
    for first in () if names else (3, 4):
        some = table[:, first : first + 3]
        in_range = some.shape[1] == 3 and (some >= 0.0).all() and 1.0 < some.max(initial=0.0) <= 255.0
        if in_range and (some == np.round(some)).all():
            return [first, first + 1, first + 2]
    return []
