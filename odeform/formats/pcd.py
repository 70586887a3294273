"""Point Cloud Data of the Point Cloud Library: text, binary, or compressed by LZF.

https://pointclouds.org/documentation/tutorials/pcd_file_format.html
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.budget import MEMORY, read_limited, require_memory
from odeform.errors import InputError
from odeform.formats.lzf import decompressed
from odeform.formats.text import numbers_of, plain_text, require_words, words_per_line
from odeform.types import PointCloud

__all__ = ["read_pcd"]

MAX_HEADER = 1 << 16  # bytes
POINT_BYTES = 24  # of memory while reading, beside the rows themselves
KINDS = {f"{letter}{size}": f"{kind}{size}" for letter, kind in zip("FIU", "fiu", strict=True) for size in (1, 2, 4, 8)}
KINDS.pop("F1")


@dataclass(frozen=True, eq=False)
class _Header:
    layout: np.dtype[Any]
    points: int
    data: str
    start: int
    lines: int


def read_pcd(path: Path, merge: bool) -> PointCloud:
    """Points with their colors. Those that are not finite, as in depth images, are left out, with a note.

    Raises:
        InputError: For a file without x, y and z, or one that is cut short.
    """
    where = f"geometry {path}"
    content = read_limited(path, where, MEMORY // 4)
    header = _header(content, where)
    require_memory(where, f"{header.points:,} points", header.points * (3 * header.layout.itemsize + POINT_BYTES))
    if header.data == "ascii":
        table = _text(content[header.start :], header, where)
    else:
        table = _binary(content[header.start :], header, where)
    xyz = np.stack([table[name].reshape(len(table)) for name in "xyz"], axis=1)
    known: NDArray[np.bool_] = np.asarray(np.isfinite(xyz).all(axis=1))
    colors = _colors(table)
    notes = [] if known.all() else [f"{(~known).sum():,} of {len(known):,} points left out, not finite"]
    others = [
        name for name in header.layout.names or () if name not in ("x", "y", "z", "rgb", "rgba") and name[:1] != "_"
    ]
    if others:
        notes.append(f"{', '.join(others)[:80]} of the points left out")
    return PointCloud(xyz[known], None if colors is None else colors[known], tuple(notes))


def _header(content: bytes, where: str) -> _Header:
    words: dict[str, list[str]] = {}
    start = lines = 0
    while "DATA" not in words:
        stop = content.find(b"\n", start, MAX_HEADER)
        if stop < 0:
            raise InputError(f"{where}: expected a header of .pcd that ends in a line DATA")
        line = content[start:stop].decode("latin-1").split()
        start, lines = stop + 1, lines + 1
        if line and not line[0].startswith("#"):
            words[line[0].upper()] = line[1:]
    names, sizes, types = (words.get(name, []) for name in ("FIELDS", "SIZE", "TYPE"))
    repeats = words.get("COUNT", ["1"] * len(names))
    fields: list[Any] = []
    try:
        for index, (name, size, kind, count) in enumerate(zip(names, sizes, types, repeats, strict=True)):
            number = int(count)
            if not 0 < number < 1 << 16:
                raise ValueError(count)
            unique = name if name != "_" and name not in names[:index] else f"_{index}"
            fields.append((unique, "<" + KINDS[f"{kind.upper()}{int(size)}"], (number,)))
        points = int(words["POINTS"][0] if "POINTS" in words else words["WIDTH"][0])
        if "POINTS" not in words and "HEIGHT" in words:
            points *= int(words["HEIGHT"][0])
        data = words["DATA"][0].lower()
    except (ValueError, KeyError, IndexError) as error:
        raise InputError(f"{where}: expected FIELDS, SIZE, TYPE, COUNT, POINTS and DATA that agree: {error}") from None
    if not {"x", "y", "z"} <= set(names) or points < 0 or data not in ("ascii", "binary", "binary_compressed"):
        raise InputError(
            f"{where}: expected fields x, y and z and data ascii, binary or binary_compressed, got "
            f"{' '.join(names)[:80]} and {data[:20]}"
        )
    return _Header(np.dtype(fields), points, data, start, lines)


def _short(header: _Header, got: int, where: str) -> InputError:
    return InputError(f"{where}: expected {header.points:,} points, got {got:,}: truncated?")


def _text(content: bytes, header: _Header, where: str) -> NDArray[Any]:
    text = plain_text(content)
    counts = words_per_line(text)
    filled = np.flatnonzero(counts)[: header.points]
    if len(filled) < header.points:
        raise _short(header, len(filled), where)
    width = sum(header.layout[name].shape[0] for name in header.layout.names or ())
    require_words(counts[filled], [width], where, filled + header.lines + 1, "numbers of a point")
    rows = text.split(b"\n")
    chosen = b"\n".join(rows[index] for index in filled) + b"\n"
    values = numbers_of(chosen, where, filled + header.lines + 1).reshape(header.points, width)
    table = np.zeros(header.points, np.dtype([(n, "<f8", header.layout[n].shape) for n in header.layout.names or ()]))
    column = 0
    for name in header.layout.names or ():
        size = header.layout[name].shape[0]
        table[name] = values[:, column : column + size]
        column += size
    for name in {"rgb", "rgba"} & set(header.layout.names or ()):
        # a color is four bytes, which may be written as one single-precision number
        kind = header.layout[name].base
        words = (
            np.clip(table[name], 0, 2.0**32 - 1).astype("<u4")
            if kind.kind in "iu"
            else table[name].astype("<f4").view("<u4")
        )
        table[name] = words
    return table


def _binary(content: bytes, header: _Header, where: str) -> NDArray[Any]:
    size = header.points * header.layout.itemsize
    if header.data == "binary":
        if len(content) < size:
            raise _short(header, len(content) // max(header.layout.itemsize, 1), where)
        return np.frombuffer(content, header.layout, header.points)
    packed, unpacked = (int.from_bytes(content[start : start + 4].ljust(4, b"\0"), "little") for start in (0, 4))
    if packed > len(content) - 8:
        raise InputError(f"{where}: expected {packed:,} compressed bytes, got {max(len(content) - 8, 0):,}: truncated?")
    if unpacked < size:
        raise _short(header, unpacked // max(header.layout.itemsize, 1), where)
    require_memory(where, f"{unpacked:,} bytes of points", unpacked)
    data = decompressed(content[8 : 8 + packed], unpacked, where)
    table, start = np.empty(header.points, header.layout), 0
    for name in header.layout.names or ():  # one field after the other
        field = header.layout[name]
        table[name] = np.frombuffer(data, field, header.points, start)
        start += field.itemsize * header.points
    return table


def _colors(table: NDArray[Any]) -> NDArray[np.uint8] | None:
    names = table.dtype.names or ()
    name = next((name for name in ("rgb", "rgba") if name in names), None)
    if name is None:
        return None
    raw = table[name].reshape(len(table), -1)[:, 0]
    words = raw.astype("<u4") if raw.dtype.itemsize == 8 else np.ascontiguousarray(raw).view("<u4")
    return np.stack([words >> 16 & 255, words >> 8 & 255, words & 255], axis=1).astype(np.uint8)
