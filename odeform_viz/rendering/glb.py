"""Binary glTF of a mesh with a color for each vertex: the only kind of mesh that viser shows with such colors."""

import json
import struct
from typing import Any

import numpy as np
from jaxtyping import UInt8, UInt16

from odeform.types import Faces, Ints, Points

__all__ = ["BRIGHTEST", "LINEAR", "GlbWriter", "untoned"]

FLOAT, UINT16, UINT32 = 5126, 5123, 5125  # component types of glTF
TRIANGLES, LINES = 4, 1  # modes of glTF
_SRGB = np.arange(256) / 255.0
LINEAR = np.round(65535.0 * np.where(_SRGB <= 0.04045, _SRGB / 12.92, ((_SRGB + 0.055) / 1.055) ** 2.4)).astype(
    np.uint16
)
"""(256,) sRGB in 8 bits to linear in 16 bits: glTF's vertex colors are linear."""

UNLIT = "KHR_materials_unlit"
BRIGHTEST = 4.0  # linear color before tone mapping that the whitest unlit color has
# the tone mapping of three.js, "ACES filmic": two matrices around a fit by a rational function
_INTO = np.array([[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]])
_OUT = np.array([[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]])
_EXPOSURE = 1.0 / 0.6
_BEFORE, _AFTER = np.linalg.inv(_INTO).T / _EXPOSURE, np.linalg.inv(_OUT).T


def untoned(colors: UInt8[np.ndarray, "points 3"]) -> UInt16[np.ndarray, "points 3"]:
    """Linear colors (N, 3), 65535 for `BRIGHTEST`, that the tone mapping of three.js turns into sRGB `colors`."""
    fitted = np.clip(LINEAR[colors] / 65535.0 @ _AFTER, 0.0, 0.99)
    # the root of (v (v + 0.0245786) - 0.000090537) / (v (0.983729 v + 0.432951) + 0.238081) = fitted
    a, b, c = 0.983729 * fitted - 1.0, 0.432951 * fitted - 0.0245786, 0.238081 * fitted + 0.000090537
    linear = (-b - np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a) @ _BEFORE
    return np.round(65535.0 * np.clip(linear / BRIGHTEST, 0.0, 1.0)).astype(np.uint16)


class GlbWriter:
    """Writes one mesh again and again with other positions and colors; all else is laid out once."""

    def __init__(
        self, count: int, faces: Faces, radius: float, opacity: float | None, wireframe: bool, unlit: bool = False
    ) -> None:
        """A mesh of `count` vertices, never farther than `radius` m from the origin; `opacity` None for opaque.

        `unlit` colors arrive on the screen as they are: no light changes them, and tone mapping is undone.
        """
        self._count, self._unlit = count, unlit
        index = _edges(faces) if wireframe else faces
        self._index = index.astype(np.uint16 if count < 1 << 16 else np.uint32).tobytes()
        self._index += bytes(-len(self._index) % 4)
        accessors = [
            {"bufferView": 0, "componentType": FLOAT, "count": count, "type": "VEC3"},
            {"bufferView": 1, "componentType": UINT16, "normalized": True, "count": count, "type": "VEC4"},
            # without data, hence zero: the client computes normals, but only where it finds some
            {"componentType": FLOAT, "count": count, "type": "VEC3"},
            {"bufferView": 2, "componentType": UINT16 if count < 1 << 16 else UINT32, "count": index.size},
        ]
        accessors[0] |= {"min": [-radius] * 3, "max": [radius] * 3}
        accessors[3]["type"] = "SCALAR"
        sizes, offset, views = (12 * count, 8 * count, len(self._index)), 0, []
        for size in sizes:
            views.append({"buffer": 0, "byteOffset": offset, "byteLength": size})
            offset += size
        material: dict[str, Any] = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0}}
        factor = [BRIGHTEST if unlit else 1.0] * 3 + [1.0 if opacity is None else opacity]
        material["pbrMetallicRoughness"]["baseColorFactor"] = factor
        if unlit:
            material["extensions"] = {UNLIT: {}}
        if opacity is not None:
            material["alphaMode"] = "BLEND"
        attributes = {"POSITION": 0, "COLOR_0": 1} | ({} if wireframe else {"NORMAL": 2})
        mode = LINES if wireframe else TRIANGLES
        document = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": attributes, "indices": 3, "material": 0, "mode": mode}]}],
            "materials": [material],
            "accessors": accessors,
            "bufferViews": views,
            "buffers": [{"byteLength": offset}],
        }
        if unlit:
            document["extensionsUsed"] = [UNLIT]
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + offset)
        self._head = head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", offset, b"BIN\0")
        self._colors = np.full((count, 4), 65535, dtype=np.uint16)

    def write(self, points: Points, colors: UInt8[np.ndarray, "points 3"]) -> bytes:
        """Writes the file for vertices (N, 3) in m and their sRGB colors (N, 3)."""
        self._colors[:, :3] = untoned(colors) if self._unlit else LINEAR[colors]
        positions = np.ascontiguousarray(points, dtype=np.float32)
        return b"".join((self._head, positions.tobytes(), self._colors.tobytes(), self._index))


def _edges(faces: Faces) -> Ints:
    """(E, 2) each edge once."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(edges, axis=1), axis=0)
