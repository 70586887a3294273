"""Arrays of numbers in VTK's XML files: text, base64, or appended bytes, compressed or not."""

import base64
import binascii
import lzma
import re
import xml.etree.ElementTree as ElementTree
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.formats.text import numbers_of, plain_text

__all__ = ["Arrays"]

TYPES = {
    **{f"Int{8 * size}": f"i{size}" for size in (1, 2, 4, 8)},
    **{f"UInt{8 * size}": f"u{size}" for size in (1, 2, 4, 8)},
    **{"Float32": "f4", "Float64": "f8"},
}


def _inflated(data: bytes, size: int) -> bytes:
    return zlib.decompressobj().decompress(data, max(size, 1))


def _unpacked(data: bytes, size: int) -> bytes:
    return lzma.LZMADecompressor().decompress(data, max(size, 1))


COMPRESSORS: dict[str, Callable[[bytes, int], bytes]] = {
    "vtkZLibDataCompressor": _inflated,
    "vtkLZMADataCompressor": _unpacked,
}


class Arrays:
    """The arrays of one file, whose header says how they are stored."""

    def __init__(self, root: ElementTree.Element, appended: bytes, encoding: str, where: str) -> None:
        self._where, self._appended, self._encoding = where, appended, encoding
        self._order = ">" if root.get("byte_order") == "BigEndian" else "<"
        self._word = np.dtype(self._order + TYPES.get(root.get("header_type", "UInt32"), "u4"))
        name = root.get("compressor", "")
        if name and name not in COMPRESSORS:
            raise InputError(f"{where}: compressed by {name[:60]}, which is not read: write it with zlib or without")
        self._decompress = COMPRESSORS.get(name)

    def count(self, of: ElementTree.Element, name: str) -> int:
        """A number of points or cells, 0 if it is not given."""
        text = of.get(name, "0").strip()
        if not (text.isascii() and text.isdigit() and len(text) < 13):
            raise InputError(f"{self._where}: {name}: expected a whole number, got {text[:40]!r}")
        return int(text)

    def read(self, array: ElementTree.Element | None, count: int) -> NDArray[Any]:
        """The `count` numbers of an array. Raises `InputError` where there are others."""
        require_memory(self._where, f"{count:,} numbers", 24 * count)
        if array is None:
            raise InputError(f"{self._where}: expected an array of {count:,} numbers, got none")
        kind, form = array.get("type", ""), array.get("format", "ascii")
        if kind not in TYPES:
            raise InputError(f"{self._where}: expected numbers of a type of {', '.join(TYPES)}, got {kind[:20]!r}")
        dtype = np.dtype(self._order + TYPES[kind])
        if form == "ascii":
            text = plain_text((array.text or "").encode())
            values = numbers_of(text, f"{self._where}: {array.get('Name') or 'points'}", range(1, 1 << 40))
        else:
            data = self._bytes(array, form, count * dtype.itemsize)
            values = np.frombuffer(data, dtype, len(data) // dtype.itemsize)
        if len(values) != count:
            name = array.get("Name") or "points"
            raise InputError(
                f"{self._where}: expected {count:,} numbers of {name[:40]}, got {len(values):,}: truncated?"
            )
        return values.astype(dtype.newbyteorder("="))

    def _bytes(self, array: ElementTree.Element, form: str, size: int) -> bytes:
        if form == "binary":
            return self._blocks(self._decoded(re.sub(r"\s+", "", array.text or "").encode()), size)
        if form != "appended":
            raise InputError(f"{self._where}: expected a format ascii, binary or appended, got {form[:20]!r}")
        data = self._appended[self.count(array, "offset") :]
        if self._encoding == "base64":
            data = self._decoded(re.sub(rb"\s+", b"", data.partition(b"<")[0]))
        return self._blocks(data, size)

    def _decoded(self, text: bytes) -> bytes:
        """Bytes of base64, of which a part may end anywhere: heads and contents are coded one by one."""
        try:
            return b"".join(base64.b64decode(part) for part in re.findall(rb"[^=]+=*", text))
        except (binascii.Error, ValueError) as error:
            raise InputError(f"{self._where}: expected base64: {error}: truncated?") from None

    def _blocks(self, data: bytes, size: int) -> bytes:
        """The content of an array behind its head, of at most `size` bytes."""
        word = self._word
        if self._decompress is None:
            length = int(self._words(data, 1)[0])
            content = data[word.itemsize : word.itemsize + min(length, size)]
            if len(content) < length and length <= size:
                raise self._short(length, len(content))
            return content
        number = int(self._words(data, 1)[0])
        if number > len(data):
            raise self._short(number, len(data))
        if not number:
            return b""
        _, whole, last, *packed = (int(value) for value in self._words(data, 3 + number))
        start, out = (3 + number) * word.itemsize, []
        for index, length in enumerate(packed):
            room = last if index == number - 1 and last else whole
            try:
                out.append(self._decompress(data[start : start + length], min(room, size)))
            except (zlib.error, lzma.LZMAError) as error:
                raise InputError(f"{self._where}: damaged compressed data: {error}") from None
            start += length
        return b"".join(out)

    def _words(self, data: bytes, count: int) -> NDArray[Any]:
        if len(data) < count * self._word.itemsize:
            raise self._short(count * self._word.itemsize, len(data))
        return np.frombuffer(data, self._word, count)

    def _short(self, expected: int, got: int) -> InputError:
        return InputError(f"{self._where}: expected {expected:,} bytes of an array, got {got:,}: truncated?")
