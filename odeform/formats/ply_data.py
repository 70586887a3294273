"""The data of PLY files, binary or text, in tables and lists."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError, counted
from odeform.formats.ply import BOM, Element, Header, Table
from odeform.formats.text import numbers_of, plain_text, words_per_line
from odeform.types import Ints

__all__ = ["Lists", "Rows", "read_rows", "read_tables"]


@dataclass(frozen=True, eq=False)
class Lists:
    """Lists of numbers, one after the other: those of row i are `counts[i]` of `values`."""

    values: NDArray[Any]
    counts: Ints


Rows = dict[str, NDArray[Any] | Lists]
"""Property -> its numbers (rows,), or its lists."""


def read_tables(path: Path, header: Header) -> dict[str, Table]:
    """Element -> table, up to the first element with lists; binary ones are memory-mapped.

    Raises `InputError` for missing rows.
    """
    tables: dict[str, Table] = {}
    plain = list(itertools.takewhile(lambda element: not element.lists, header.elements))
    if header.order == "=":
        for element, rows in zip(plain, _text_rows(path, header, plain, []), strict=True):
            layout = _layout(element, header.order)
            tables[element.name] = np.empty(element.rows, layout)
            for name in layout.names or ():
                tables[element.name][name] = rows[name]
        return tables
    start, data = header.start, _mapped(path)
    for element in plain:
        layout = _layout(element, header.order)
        tables[element.name] = _table(data, start, element, layout, path)
        start += element.rows * layout.itemsize
    return tables


def read_rows(path: Path, header: Header, notes: list[str]) -> dict[str, Rows]:
    """Element -> its properties, of all elements. What follows the last row is left out, and `notes` say so.

    Raises `InputError` for missing rows and damaged lists.
    """
    if header.order == "=":
        rows = _text_rows(path, header, header.elements, notes)
        return {element.name: found for element, found in zip(header.elements, rows, strict=True)}
    out: dict[str, Rows] = {}
    start, data = header.start, _mapped(path)
    for element in header.elements:
        if not element.lists:
            layout = _layout(element, header.order)
            table = _table(data, start, element, layout, path)
            out[element.name] = {name: table[name] for name in layout.names or ()}
            start += element.rows * layout.itemsize
            continue
        out[element.name], start = _binary_lists(data, start, element, header.order, path)
    if (extra := len(data) - start) > 0:
        notes.append(f"{counted(extra, 'byte')} after the last row left out")
    return out


def _layout(element: Element, order: str) -> np.dtype[Any]:
    return np.dtype([(entry.name, order + entry.kind) for entry in element.properties])


def _short(path: Path, element: Element, got: int) -> InputError:
    return InputError(f"geometry {path}: expected {element.rows} rows of {element.name}, got {got}: truncated?")


def _mapped(path: Path) -> NDArray[np.uint8]:
    """The bytes of a file, which are read when they are used."""
    # a plain view: slices of NumPy's class for such files are slow
    return np.memmap(path, np.uint8, "r").view(np.ndarray)


def _table(data: NDArray[np.uint8], start: int, element: Element, layout: np.dtype[Any], path: Path) -> Table:
    present = min(element.rows, max(len(data) - start, 0) // max(layout.itemsize, 1))
    if present < element.rows:
        raise _short(path, element, present)
    return np.ndarray(present, layout, data, start if present else 0)


def _binary_lists(data: NDArray[np.uint8], start: int, element: Element, order: str, path: Path) -> tuple[Rows, int]:
    """The rows of an element with lists, and where they end."""
    even = _even_lists(data, start, element, order)
    if even is not None:
        return even
    sizes = [
        (np.dtype(entry.count or entry.kind).itemsize, np.dtype(entry.kind).itemsize, entry.count)
        for entry in element.properties
    ]
    places = np.empty((element.rows if element.rows <= len(data) else 0, len(sizes)), np.int64)
    if len(places) < element.rows:
        raise _short(path, element, len(data) - start)
    counts = np.zeros_like(places)
    position, end, raw = start, len(data), data.data
    kinds = [order.replace("=", "<") + entry.count if entry.count else "" for entry in element.properties]
    byteorder = "little" if order == "<" else "big"
    for row in range(element.rows):
        for column, (head, item, is_list) in enumerate(sizes):
            places[row, column] = position
            position += head
            if is_list and position <= end:
                count = int.from_bytes(raw[position - head : position], byteorder, signed=kinds[column][1] == "i")
                if count < 0:
                    raise InputError(f"geometry {path}: row {row + 1} of {element.name}: a list of {count} numbers")
                counts[row, column] = count
                position += count * item
        if position > end:
            raise _short(path, element, row)
    out: Rows = {}
    for column, (entry, (head, _, _)) in enumerate(zip(element.properties, sizes, strict=True)):
        kind = np.dtype(order + entry.kind)
        number = counts[:, column] if entry.count else np.ones(element.rows, np.int64)
        first = places[:, column] + (head if entry.count else 0)
        within = np.arange(int(number.sum())) - np.repeat(np.cumsum(number) - number, number)
        at = np.repeat(first, number) + within * kind.itemsize
        values = np.ascontiguousarray(data[at[:, None] + np.arange(kind.itemsize)]).view(kind)[:, 0]
        out[entry.name] = Lists(values, number) if entry.count else values
    return out, position


def _even_lists(data: NDArray[np.uint8], start: int, element: Element, order: str) -> tuple[Rows, int] | None:
    """Reads as `_binary_lists` does where all lists of a property have one length, as in a mesh of triangles; None
    otherwise."""
    fields: list[tuple[str, Any, Any]] = []
    position, lengths = start, []
    for column, entry in enumerate(element.properties):
        if not entry.count:
            fields.append((str(column), order + entry.kind, ()))
            position += np.dtype(entry.kind).itemsize
            continue
        head = np.dtype(order + entry.count)
        raw = data[position : position + head.itemsize]
        if len(raw) < head.itemsize or head.kind not in "iu":
            return None
        length = int(raw.view(head)[0])
        if not 0 <= length <= len(data):
            return None
        lengths.append((column, length))
        fields += [(f"n{column}", head, ()), (str(column), order + entry.kind, (length,))]
        position += head.itemsize + length * np.dtype(entry.kind).itemsize
    layout = np.dtype(fields)
    stop = start + element.rows * layout.itemsize
    if not element.rows or stop > len(data):
        return None
    table = np.ndarray(element.rows, layout, data, start)
    if not all((table[f"n{column}"] == length).all() for column, length in lengths):
        return None
    out: Rows = {}
    for column, entry in enumerate(element.properties):
        values = table[str(column)]
        counts = np.full(element.rows, values.shape[1]) if entry.count else None
        out[entry.name] = values if counts is None else Lists(values.reshape(-1), counts)
    return out, stop


def _text_rows(path: Path, header: Header, elements: Sequence[Element], notes: list[str]) -> Iterator[Rows]:
    """The rows of elements, one line each; blank lines do not count."""
    with path.open("rb") as file:
        file.seek(header.start)
        text = plain_text(file.read().removeprefix(BOM))
    counts = words_per_line(text)
    filled = np.flatnonzero(counts)
    stops = np.flatnonzero(np.frombuffer(text, np.uint8) == 10) + 1
    used = 0
    for element in elements:
        if used + element.rows > len(filled):
            raise _short(path, element, len(filled) - used)
        chosen = filled[used : used + element.rows]
        used += element.rows
        if not element.rows:
            yield {
                e.name: Lists(np.zeros(0), np.zeros(0, np.int64)) if e.count else np.zeros(0)
                for e in element.properties
            }
            continue
        part = text[stops[chosen[0] - 1] if chosen[0] else 0 : stops[chosen[-1]]]
        lines = header.lines + 1 + chosen
        values = numbers_of(part, f"geometry {path}", range(lines[0], lines[-1] + 1))
        yield _split_rows(values, counts[chosen], element, path, lines)
    if used < len(filled):
        notes.append(f"{counted(len(filled) - used, 'line')} after the last row left out")


def _split_rows(values: NDArray[np.float64], counts: Ints, element: Element, path: Path, lines: Ints) -> Rows:
    """The properties of rows of numbers (N,), of which each line has `counts` (rows,)."""
    place, out = np.cumsum(counts) - counts, {}
    stop = place + counts
    for entry in element.properties:
        length = np.ones(len(counts), np.int64)
        inside = place < stop
        if entry.count and inside.all():
            length = values[place].astype(np.int64)
            place = place + 1
            inside = (length >= 0) & (place + length <= stop)
        if not inside.all():
            odd = int(np.argmin(inside))
            raise InputError(
                f"geometry {path}: line {lines[odd]}: expected a row of {element.name} ({_described(element)}), got "
                f"{counts[odd]} numbers: truncated?"
            )
        within = np.arange(int(length.sum())) - np.repeat(np.cumsum(length) - length, length)
        found = values[np.repeat(place, length) + within]
        if np.dtype(entry.kind).kind in "iu":
            found = np.clip(np.nan_to_num(found), -(2.0**62), 2.0**62).astype(np.int64)
            if not entry.count:  # colors are fractions of what their type can hold
                limits = np.iinfo(entry.kind)
                found = np.clip(found, limits.min, min(limits.max, 1 << 62)).astype(entry.kind)
        out[entry.name] = Lists(found, length) if entry.count else found
        place = place + length
    if element.lists and (place <= stop).all() and (place < stop).any():
        # old versions of MeshLab write other columns behind the lists than the header says
        out = {entry.name: out[entry.name] for entry in element.properties if entry.count}
    elif not (place == stop).all():
        odd = int(np.argmax(place != stop))
        raise InputError(
            f"geometry {path}: line {lines[odd]}: expected a row of {element.name} ({_described(element)}), got "
            f"{counts[odd]} numbers: are rows missing, truncated?"
        )
    return out


def _described(element: Element) -> str:
    names = [f"list {entry.name}" if entry.count else entry.name for entry in element.properties]
    return " ".join(names if len(names) <= 6 else [*names[:5], f"and {len(names) - 5} more"])
