"""A glTF 2.0 file as its JSON and the bytes of its buffers. What it claims to hold is checked before it is allocated.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html, sections 3.4 (extensions), 3.6 (buffers) and 4.4 (GLB).
"""

import base64
import binascii
import struct
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from odeform.budget import MEMORY, read_limited, require_memory
from odeform.errors import InputError
from odeform.io import parse_json

__all__ = ["Document", "read_document"]

Tree = Mapping[str, Any]

CHUNK = struct.Struct("<II")  # length, type
JSON, BINARY = 0x4E4F534A, 0x004E4942
ACCESSOR_BYTES = 64  # of memory while reading: an element of an accessor
KNOWN = (
    *("KHR_mesh_quantization", "KHR_texture_transform", "EXT_mesh_gpu_instancing", "KHR_gaussian_splatting"),
    *("EXT_texture_webp", "EXT_texture_avif", "KHR_texture_basisu", "MSFT_texture_dds", "KHR_node_visibility"),
)
"""Extensions that are read, or left out with a note."""
OF_LOOKS = (
    "KHR_materials_",
    "KHR_technique",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_animation_pointer",
    "KHR_xmp",
    "EXT_materials_",
)
"""Starts of the names of extensions that change neither the shape nor its base color, or whose color is read."""
COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")


class Document:
    """The JSON of a file, and what its buffers hold.

    Attributes:
        where: What leads the message of an error.
        tree: The JSON.
        notes: What is left out, in the order in which it was met, each once.
    """

    def __init__(self, path: Path, tree: Tree, binary: bytes | None) -> None:
        self.path, self.where, self.tree = path, f"geometry {path}", tree
        self.notes: dict[str, None] = {}
        self._binary = binary
        self._buffers: dict[int, bytes] = {}
        self._require_known()
        self._require_modest()

    def note(self, text: str) -> None:
        """Add a note, once."""
        self.notes.setdefault(text)

    def items(self, name: str, within: Tree | None = None) -> list[Tree]:
        """The objects of an array of the JSON. Raises `InputError` where it is anything else."""
        items = (self.tree if within is None else within).get(name, [])
        if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
            raise InputError(f"{self.where}: expected {name} to be a list of objects")
        return items

    def item(self, name: str, index: object) -> Tree:
        """One object of an array. Raises `InputError` for an index that is none."""
        items = self.items(name)
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(items):
            raise InputError(f"{self.where}: refers to {name} {index!r}, of {len(items)}")
        return items[index]

    def number(self, of: Tree, name: str, default: int | None = None) -> int:
        """Reads a whole number of at least 0. Raises `InputError` for anything else."""
        value = of.get(name, default)
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if not isinstance(value, int) or isinstance(value, bool) or value < 0:
            raise InputError(f"{self.where}: {name}: expected a whole number, got {value!r}")
        return value

    def extension(self, of: Tree, name: str) -> Tree | None:
        """Returns what an extension says of an object; None without."""
        extensions = of.get("extensions")
        found = extensions.get(name) if isinstance(extensions, dict) else None
        return found if isinstance(found, dict) else None

    def view(self, index: object) -> bytes:
        """The bytes of a buffer view. Raises `InputError` where they are compressed or missing."""
        view = self.item("bufferViews", index)
        start, size = self.number(view, "byteOffset", 0), self.number(view, "byteLength")
        buffer = view.get("buffer")
        data = self._buffer(buffer)
        if start + size > len(data):
            raise InputError(
                f"{self.where}: buffer view {index}: expected {size:,} bytes from {start:,} on, got a buffer of "
                f"{len(data):,}: truncated?"
            )
        return data[start : start + size]

    def read_beside(self, uri: str) -> bytes | None:
        """The content of a URI: data, or a file in the folder of this one; None where there is no such file."""
        if uri.startswith("data:"):
            head, comma, data = uri.partition(",")
            if not comma:
                raise InputError(f"{self.where}: expected a comma in the URI {uri[:40]!r}")
            try:
                return base64.b64decode(data, validate=False) if head.endswith(";base64") else unquote(data).encode()
            except (binascii.Error, ValueError):
                raise InputError(f"{self.where}: expected base64 in the URI {uri[:40]!r}") from None
        file = next((file for name in (unquote(uri), uri) if (file := self.path.parent / name).exists()), None)
        return None if file is None else read_limited(file, f"{self.where}: {uri[:100]}", MEMORY // 4)

    def _buffer(self, index: object) -> bytes:
        item = self.item("buffers", index)
        assert isinstance(index, int)
        if index not in self._buffers:
            uri = item.get("uri")
            data = self._binary if uri is None and index == 0 else None
            for name in COMPRESSED:
                if uri is None and data is None and self.extension(item, name):  # a place for what it would unpack
                    raise InputError(self._compressed(name))
            if isinstance(uri, str):
                data = self.read_beside(uri)
            if data is None:
                what = f"no such file {uri[:100]!r} beside it" if isinstance(uri, str) else "expected a URI, got none"
                raise InputError(f"{self.where}: buffer {index}: {what}")
            size = self.number(item, "byteLength")
            if len(data) < size:
                raise InputError(
                    f"{self.where}: buffer {index}: expected {size:,} bytes, got {len(data):,}: truncated?"
                )
            self._buffers[index] = data
        return self._buffers[index]

    def _compressed(self, name: str) -> str:
        return (
            f"{self.where}: compressed by the glTF extension {name}, which is not read: export it without compression"
        )

    def require_uncompressed(self, primitive: Tree) -> None:
        """Raise `InputError` for a primitive whose numbers only a known compression has."""
        for name in COMPRESSED:
            if self.extension(primitive, name) and not self._has_data(primitive):
                raise InputError(self._compressed(name))

    def _has_data(self, primitive: Tree) -> bool:
        attributes = primitive.get("attributes")
        position = attributes.get("POSITION") if isinstance(attributes, dict) else None
        indices = [index for index in (position, primitive.get("indices")) if index is not None]
        return all("bufferView" in self.item("accessors", index) for index in indices)

    @cached_property
    def _required(self) -> list[str]:
        names = self.tree.get("extensionsRequired", [])
        return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []

    def _require_known(self) -> None:
        asset = self.tree.get("asset")
        version = str(asset.get("version", "")) if isinstance(asset, dict) else ""
        if not version.startswith("2."):
            raise InputError(
                f"{self.where}: expected glTF 2.0, got {(version[:20] and f'version {version[:20]}') or 'no version'}"
            )
        for name in self._required:
            if name in COMPRESSED:
                raise InputError(self._compressed(name))
            if name not in KNOWN and not name.startswith(OF_LOOKS):
                raise InputError(f"{self.where}: requires the glTF extension {name[:100]}, which is not read")

    def _require_modest(self) -> None:
        counts = [self.number(accessor, "count", 0) for accessor in self.items("accessors")]
        require_memory(self.where, f"{sum(counts):,} elements of accessors", ACCESSOR_BYTES * sum(counts))
        for item in (*self.items("buffers"), *self.items("images")):
            uri = item.get("uri", "")
            if isinstance(uri, str) and not uri.startswith("data:") and uri:
                self._require_beside(uri)

    def _require_beside(self, uri: str) -> None:
        """Raise `InputError` unless a buffer or an image lies in the file's own folder, or below."""
        folder = self.path.parent.resolve()
        for name in {unquote(uri), uri}:
            try:
                file = (self.path.parent / name).resolve()
                inside = "://" not in name and file.is_relative_to(folder)
                is_file = file.is_file() or not file.exists()
            except (OSError, ValueError):  # a name that no file can have
                raise InputError(f"{self.where}: refers to {uri[:100]!r}, which is no name of a file") from None
            if not inside:
                raise InputError(f"{self.where}: refers to {uri[:100]}, outside of its folder")
            if not is_file:
                raise InputError(f"{self.where}: refers to {uri[:100]}, which is not a file")


def read_document(path: Path) -> Document:
    """Read a .gltf or a .glb, told apart by their content.

    Raises:
        InputError: For a damaged file, a required extension that is not known, files elsewhere, and too much memory.
    """
    where = f"geometry {path}"
    data = read_limited(path, where, MEMORY // 4)
    binary = None
    if data[:4] == b"glTF":
        data, binary = _chunks(data, where)
    elif data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] != b"{" and b"\0" not in data[:8]:  # else JSON in UTF-16
        raise InputError(f"{where}: expected glTF, binary or as JSON, got {data[:12]!r}")
    tree = parse_json(data.removeprefix(b"\xef\xbb\xbf"), where)
    if not isinstance(tree, dict):
        raise InputError(f"{where}: expected a JSON object of glTF")
    return Document(path, tree, binary)


def _chunks(data: bytes, where: str) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk of a GLB."""
    version, length = struct.unpack_from("<II", data.ljust(12, b"\0"), 4)
    if version != 2:
        raise InputError(f"{where}: expected binary glTF 2, got version {version}")
    if length > len(data) or len(data) < 20:
        raise InputError(f"{where}: expected {max(length, 20):,} bytes, got {len(data):,}: truncated?")
    chunks: dict[int, bytes] = {}
    start = 12
    while start + CHUNK.size <= len(data):
        size, kind = CHUNK.unpack_from(data, start)
        start += CHUNK.size
        if start + size > len(data):
            raise InputError(f"{where}: expected a chunk of {size:,} bytes, got {len(data) - start:,}: truncated?")
        chunks.setdefault(kind, data[start : start + size])
        start += size
    if JSON not in chunks:
        raise InputError(f"{where}: expected a chunk of JSON in a .glb")
    return chunks[JSON], chunks.get(BINARY)
