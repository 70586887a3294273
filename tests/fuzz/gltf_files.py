"""glTF files for tests, of arrays and a tree of JSON."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from odeform.formats.glb import glb_bytes

__all__ = ["COMPONENTS", "POINTS", "TETRAHEDRON", "Gltf"]

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 1]], np.float32)
TETRAHEDRON = np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], np.uint16)
COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Gltf:
    """A document with one mesh of one primitive, a tetrahedron two units high, unless told otherwise."""

    def __init__(self, points: np.ndarray = POINTS, indices: np.ndarray | None = TETRAHEDRON) -> None:
        self.data = b""
        self.tree: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "accessors": [],
            "bufferViews": [],
        }
        self.primitive: dict[str, Any] = {"attributes": {"POSITION": self.add(points)}}
        if indices is not None:
            self.primitive["indices"] = self.add(indices)
        self.tree["meshes"] = [{"primitives": [self.primitive]}]

    def view(self, content: bytes) -> int:
        """Add bytes; returns the index of their buffer view."""
        self.tree["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content)})
        self.data += content + bytes(-len(content) % 4)
        return len(self.tree["bufferViews"]) - 1

    def add(self, array: np.ndarray, **more: Any) -> int:
        """Add numbers; returns the index of their accessor."""
        flat = array.reshape(len(array), -1)
        accessor = {
            "bufferView": self.view(array.tobytes()),
            "componentType": COMPONENTS[array.dtype.name],
            "count": len(array),
            "type": KINDS[flat.shape[1]],
            **more,
        }
        self.tree["accessors"].append(accessor)
        return len(self.tree["accessors"]) - 1

    def glb(self, path: Path) -> Path:
        """Write a .glb."""
        self.tree["buffers"] = [{"byteLength": len(self.data)}, *self.tree.get("buffers", [])[1:]]
        chunk = len(self.data).to_bytes(4, "little") + b"BIN\0" + self.data
        path.write_bytes(glb_bytes(self.tree, chunk))
        return path

    def gltf(self, path: Path, uri: str, name: str) -> Path:
        """Write a .gltf that refers to `uri`, and its buffer in the file `name` beside it."""
        self.tree["buffers"] = [{"byteLength": len(self.data), "uri": uri}]
        path.write_text(json.dumps(self.tree))
        (path.parent / name).write_bytes(self.data)
        return path
