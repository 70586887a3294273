"""Building binary glTF 2.0: one buffer of accessors, and the JSON that refers to them.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html, sections 3.6 (buffers and accessors) and 4.4 (GLB).
"""

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["INDICES", "VERTICES", "GlbBuffer", "glb_bytes"]

VERTICES, INDICES = 34962, 34963
"""Targets of buffer views: ARRAY_BUFFER and ELEMENT_ARRAY_BUFFER."""

COMPONENTS = {"<f4": 5126, "<u4": 5125}
KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
ALIGNMENT = 4  # bytes, of chunks


class GlbBuffer:
    """Arrays one after the other, each with a buffer view and an accessor of its own."""

    def __init__(self) -> None:
        self.accessors: list[dict[str, Any]] = []
        self.views: list[dict[str, Any]] = []
        self._parts: list[bytes] = []
        self._length = 0

    def add(self, array: NDArray[Any], target: int | None = None) -> int:
        """Add (M,), (M, 3) or (M, 4) numbers; returns the index of the accessor. All are stored in four bytes.

        Floats become float32, integers uint32. `target` is `VERTICES`, `INDICES`, or None for animations.
        """
        kind = "<f4" if array.dtype.kind == "f" else "<u4"
        data = np.ascontiguousarray(array, dtype=kind)
        flat = data.reshape(len(data), -1)
        part = data.tobytes()
        view = {"buffer": 0, "byteOffset": self._length, "byteLength": len(part)}
        self.accessors.append(
            {
                "bufferView": len(self.views),
                "componentType": COMPONENTS[kind],
                "count": len(data),
                "type": KINDS[flat.shape[1]],
                "min": flat.min(axis=0).tolist(),
                "max": flat.max(axis=0).tolist(),
            }
        )
        self.views.append(view if target is None else {**view, "target": target})
        self._parts.append(part)
        self._length += len(part)
        return len(self.accessors) - 1

    def document(self, tree: dict[str, Any]) -> bytes:
        """The whole file: `tree` is the JSON without accessors, views and buffers."""
        buffers = [{"byteLength": self._length}]
        complete = {**tree, "accessors": self.accessors, "bufferViews": self.views, "buffers": buffers}
        return glb_bytes(complete, _chunk(b"BIN\0", b"".join(self._parts)))


def glb_bytes(tree: dict[str, Any], rest: bytes) -> bytes:
    """A GLB file of a JSON `tree`, followed by its other chunks as they are."""
    content = json.dumps(tree, separators=(",", ":"), allow_nan=False).encode()
    content += b" " * (-len(content) % ALIGNMENT)
    first = _chunk(b"JSON", content)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(first) + len(rest)) + first + rest


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack("<I4s", len(content), kind) + content
