"""What a glTF file claims to hold, from its JSON alone: a few bytes may ask for any number of vertices.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html, sections 3.5 (nodes), 3.6 (buffers and accessors), 4.4 (GLB).
"""

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from odeform.budget import MEMORY, read_limited, require_memory
from odeform.errors import InputError
from odeform.io import parse_json

__all__ = ["require_modest_gltf"]

HEADER = struct.Struct("<4sIIII")  # magic, version, length, length of the JSON, type of the chunk
INSTANCES = 100_000
VERTEX_BYTES = 400  # of memory while reading: a vertex or an index of a placed mesh
ACCESSOR_BYTES = 64  # of memory while reading: an element of an accessor


def require_modest_gltf(path: Path) -> None:
    """Raise `InputError` for a file that takes more than 2 GB of memory, or refers to files elsewhere."""
    where = f"geometry {path}"
    tree = _tree(path, where)
    accessors = [_count(accessor) for accessor in _list(tree, "accessors")]
    require_memory(where, f"{sum(accessors):,} elements of accessors", ACCESSOR_BYTES * sum(accessors))
    sizes = [_size(mesh, accessors) for mesh in _list(tree, "meshes")]
    placed = [node["mesh"] for node in _list(tree, "nodes") if isinstance(node.get("mesh"), int)]
    if len(placed) > INSTANCES:
        raise InputError(f"{where}: expected at most {INSTANCES:,} nodes with a mesh, got {len(placed):,}")
    total = sum(sizes[mesh] for mesh in placed if 0 <= mesh < len(sizes))
    require_memory(where, f"{total:,} vertices and indices of {len(placed):,} placed meshes", VERTEX_BYTES * total)
    for item in (*_list(tree, "buffers"), *_list(tree, "images")):
        uri = item.get("uri", "")
        if isinstance(uri, str) and not uri.startswith("data:") and uri:
            _require_beside(path, uri, where)


def _tree(path: Path, where: str) -> Mapping[str, Any]:
    data = read_limited(path, where, MEMORY // 8)
    if data[:4] == b"glTF":
        length = HEADER.unpack_from(data.ljust(HEADER.size, b"\0"))[3]
        data = data[HEADER.size : HEADER.size + length]
    tree = parse_json(data, where)
    if not isinstance(tree, dict):
        raise InputError(f"{where}: expected a JSON object of glTF")
    return tree


def _list(tree: Mapping[str, Any], name: str) -> list[Mapping[str, Any]]:
    items = tree.get(name, [])
    return [item for item in items if isinstance(item, dict)] if isinstance(items, list) else []


def _count(accessor: Mapping[str, Any]) -> int:
    count = accessor.get("count", 0)
    return count if isinstance(count, int) and count > 0 else 0


def _size(mesh: Mapping[str, Any], accessors: list[int]) -> int:
    """Vertices and indices of all parts of a mesh."""
    total = 0
    for part in _list(mesh, "primitives"):
        attributes = part.get("attributes")
        position = attributes.get("POSITION") if isinstance(attributes, dict) else None
        for index in (position, part.get("indices")):
            total += accessors[index] if isinstance(index, int) and 0 <= index < len(accessors) else 0
    return total


def _require_beside(path: Path, uri: str, where: str) -> None:
    """Raise `InputError` unless a buffer or an image lies in the file's own folder, or below."""
    folder, file = path.parent.resolve(), (path.parent / uri).resolve()
    if "://" in uri or not file.is_relative_to(folder):
        raise InputError(f"{where}: refers to {uri[:100]}, outside of its folder")
    if file.exists():
        size = file.stat().st_size
        if not file.is_file():
            raise InputError(f"{where}: refers to {uri[:100]}, which is not a file")
        require_memory(where, f"{size:,} bytes of {uri[:100]}", 4 * size)
