"""VTK's XML formats: `.vtu` (UnstructuredGrid) and `.vtp` (PolyData), as text, base64 or appended, also compressed.

Kitware, "VTK File Formats", https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html.
"""

import base64
import binascii
import lzma
import re
import xml.etree.ElementTree as ElementTree
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.formats.vtk_grid import POLYGON, STRIP, Grid

__all__ = ["parsed_xml", "read_xml_grid"]

TYPES = {
    f"{name}{8 * width}": f"{code}{width}" for name, code in (("Int", "i"), ("UInt", "u")) for width in (1, 2, 4, 8)
}
TYPES |= {"Float32": "f4", "Float64": "f8"}
LISTS = {"Verts": 2, "Lines": 4, "Strips": STRIP, "Polys": POLYGON}
APPENDED = re.compile(rb"<AppendedData\b[^>]*>\s*_")
COPIES = 4

Array = NDArray[Any]


def _inflated(data: bytes, most: int) -> bytes:
    return zlib.decompressobj().decompress(data, most)


def _unpacked(data: bytes, most: int) -> bytes:
    return lzma.LZMADecompressor().decompress(data, most)


COMPRESSORS: dict[str, Callable[[bytes, int], bytes]] = {
    "vtkZLibDataCompressor": _inflated,
    "vtkLZMADataCompressor": _unpacked,
}


def parsed_xml(data: bytes, where: str) -> ElementTree.Element:
    """Parses the root of an XML text without entities of its own. Raises `InputError`, which `where` leads."""
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise InputError(f"{where}: expected XML without a document type")
    try:
        return ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"{where}: not valid XML: {error}") from None


def read_xml_grid(data: bytes, where: str) -> Grid:
    """The data set in the bytes of a `.vtu` or `.vtp` file, its pieces joined.

    Raises `InputError`, which `where` leads, in words that name the array that is wrong.
    """
    found = APPENDED.search(data)
    appended, raw = b"", False
    if found:
        end = data.rfind(b"</AppendedData>")
        raw = b"raw" in found[0]
        appended = data[found.end() : end if end > 0 else None]
        data = data[: found.end()] + b"</AppendedData></VTKFile>"
    root = parsed_xml(data, where)
    kind = root.get("type", "")
    if root.tag != "VTKFile" or kind not in ("UnstructuredGrid", "PolyData"):
        got = kind or root.tag[:60]
        raise InputError(f"{where}: expected a VTKFile of type UnstructuredGrid or PolyData, got {got}")
    decoder = _decoder(root, appended, raw, where)
    pieces = [_piece(piece, kind, decoder) for piece in root.iter("Piece")]
    if not pieces:
        raise InputError(f"{where}: expected a Piece, got none")
    return pieces[0] if len(pieces) == 1 else _joined(pieces)


@dataclass(frozen=True)
class _Decoder:
    """How the arrays of one file are stored."""

    where: str
    order: str
    header: np.dtype[Any]
    """The type of the numbers that lead binary arrays."""
    decompress: Callable[[bytes, int], bytes] | None
    appended: bytes
    raw: bool

    def array(self, element: ElementTree.Element) -> Array:
        """The numbers of a DataArray."""
        name = element.get("Name") or "Points"
        kind = TYPES.get(element.get("type", ""))
        if kind is None:
            raise self.error(name, f"expected a type such as Float32, got {element.get('type')}")
        dtype = np.dtype(kind)
        form = element.get("format", "ascii")
        if form == "ascii":
            words = (element.text or "").split()
            try:
                return np.array(words, dtype=str).astype(float if dtype.kind == "f" else np.int64)
            except (ValueError, OverflowError):
                raise self.error(name, "expected numbers, got other text") from None
        try:
            if form == "appended":
                data, encoded = self.appended[int(element.get("offset", "0")) :], not self.raw
            else:
                data, encoded = "".join((element.text or "").split()).encode(), True
            content = self._content(data, encoded, name)
        except (ValueError, binascii.Error, zlib.error, lzma.LZMAError) as error:
            if isinstance(error, InputError):
                raise
            raise self.error(name, f"damaged: {error}") from None
        if len(content) % dtype.itemsize:
            raise self.error(name, f"expected numbers of {dtype.itemsize} bytes, got {len(content)} bytes")
        return np.frombuffer(content, np.dtype(self.order + kind)).astype(dtype)

    def _content(self, data: bytes, encoded: bool, name: str) -> bytes:
        width = self.header.itemsize
        head = self._bytes(data, 0, width, encoded, name)
        (first,) = np.frombuffer(head, self.header).tolist()
        if self.decompress is None:
            letters = -(-width // 3) * 4
            # header and content are encoded one by one, or else together
            if encoded and data[:letters].endswith(b"=" * (-width % 3)):
                return self._bytes(data[letters:], 0, first, encoded, name)
            if encoded:
                return self._bytes(data, 0, width + first, encoded, name)[width:]
            return self._bytes(data, width, first, encoded, name)
        require_memory(f"{self.where}: {name}", f"{first:,} blocks", COPIES * width * first)
        sizes = np.frombuffer(self._bytes(data, 0, (3 + first) * width, encoded, name), self.header)[1:].tolist()
        block, last, *compressed = sizes
        whole = [*[block] * (first - 1), last or block] if first else []
        require_memory(f"{self.where}: {name}", f"{sum(whole):,} bytes", COPIES * sum(whole))
        start = (3 + first) * width
        data = data[-(-start // 3) * 4 :] if encoded else data[start:]
        packed = self._bytes(data, 0, sum(compressed), encoded, name)
        parts, place = [], 0
        for size, most in zip(compressed, whole, strict=True):
            parts.append(self.decompress(packed[place : place + size], most))
            if len(parts[-1]) != most:
                raise self.error(name, f"expected a block of {most:,} bytes, got {len(parts[-1]):,}")
            place += size
        return b"".join(parts)

    def _bytes(self, data: bytes, start: int, size: int, encoded: bool, name: str) -> bytes:
        """`size` bytes from `start`, decoded."""
        end = start + size
        part = base64.b64decode(data[: -(-end // 3) * 4], validate=True) if encoded else data[:end]
        if len(part) < end:
            raise self.error(name, f"expected {end:,} bytes, got {len(part):,}: truncated?")
        return part[start:end]

    def error(self, name: str, text: str) -> InputError:
        return InputError(f"{self.where}: array {name}: {text}")


def _decoder(root: ElementTree.Element, appended: bytes, raw: bool, where: str) -> _Decoder:
    order = {"BigEndian": ">", "LittleEndian": "<"}.get(root.get("byte_order", "LittleEndian"), "<")
    header = np.dtype(order + TYPES.get(root.get("header_type", "UInt32"), "u4"))
    compressor = root.get("compressor", "")
    if compressor and compressor not in COMPRESSORS:
        raise InputError(
            f"{where}: compressed by {compressor}, which is not read: save with compressor type ZLib, or none"
        )
    return _Decoder(where, order, header, COMPRESSORS.get(compressor), appended if raw else appended.strip(), raw)


def _piece(piece: ElementTree.Element, kind: str, decoder: _Decoder) -> Grid:
    element = piece.find("Points/DataArray")
    points = np.zeros((0, 3)) if element is None else decoder.array(element)
    stated = piece.get("NumberOfPoints", str(len(points) // 3))
    if points.size % 3 or (points.size != 3 * int(stated) if stated.isdecimal() else True):
        raise decoder.error("Points", f"expected {stated} points of three coordinates, got {points.size:,} numbers")
    parts = [_cells(piece, "Cells", None, decoder)]
    if kind == "PolyData":
        parts = [_cells(piece, name, number, decoder) for name, number in LISTS.items()]
    points = points.reshape(-1, 3)
    fields = {name: values for name, values in _vectors(piece, decoder) if values.shape == points.shape}
    connectivity, offsets, types = _chained(parts)
    return Grid(points, connectivity, offsets, types, fields)


def _cells(piece: ElementTree.Element, name: str, kind: int | None, decoder: _Decoder) -> tuple[Array, Array, Array]:
    """Connectivity, offsets from 0, and types of one list of cells."""
    wanted = ("connectivity", "offsets") if kind is not None else ("connectivity", "offsets", "types")
    arrays = {element.get("Name"): element for element in piece.findall(f"{name}/DataArray")}
    if not arrays:
        return np.zeros(0, np.int64), np.zeros(1, np.int64), np.zeros(0, np.int64)
    if missing := [part for part in wanted if part not in arrays]:
        raise decoder.error(name, f"expected {', '.join(wanted)}, got no {missing[0]}")
    connectivity, ends, *types = (decoder.array(arrays[part]).astype(np.int64) for part in wanted)
    offsets = np.concatenate([np.zeros(1, np.int64), ends])
    if (np.diff(offsets) < 0).any() or offsets[-1] > len(connectivity):
        raise decoder.error(f"{name}/offsets", f"expected offsets that increase up to {len(connectivity):,}")
    return connectivity[: offsets[-1]], offsets, types[0] if types else np.full(len(ends), kind)


def _vectors(piece: ElementTree.Element, decoder: _Decoder) -> Iterator[tuple[str, Array]]:
    for element in piece.findall("PointData/DataArray"):
        if element.get("NumberOfComponents") == "3" and element.get("type", "").startswith("Float"):
            values = decoder.array(element)
            yield element.get("Name", ""), values[: len(values) // 3 * 3].reshape(-1, 3)


def _chained(parts: list[tuple[Array, Array, Array]]) -> tuple[Array, Array, Array]:
    starts = np.cumsum([0, *(len(connectivity) for connectivity, _, _ in parts)])
    return (
        np.concatenate([connectivity for connectivity, _, _ in parts]),
        np.concatenate([starts[:1], *(own[1:] + start for (_, own, _), start in zip(parts, starts, strict=False))]),
        np.concatenate([types for _, _, types in parts]),
    )


def _joined(pieces: list[Grid]) -> Grid:
    starts = np.cumsum([0, *(len(piece.points) for piece in pieces)])
    parts = [
        (piece.connectivity + start, piece.offsets, piece.types) for piece, start in zip(pieces, starts, strict=False)
    ]
    names = set.intersection(*(set(piece.vectors) for piece in pieces))
    vectors = {name: np.concatenate([piece.vectors[name] for piece in pieces]) for name in sorted(names)}
    return Grid(np.concatenate([piece.points for piece in pieces]), *_chained(parts), vectors)
