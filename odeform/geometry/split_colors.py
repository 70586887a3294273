"""Colours at the corners of faces, as colours of vertices."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int, UInt8

from odeform.types import Mesh

__all__ = ["SplitColors", "split_colors"]


@dataclass(frozen=True, eq=False)
class SplitColors:
    """M vertices with one colour each: one whose faces differ in colour is split."""

    vertices: Int[np.ndarray, " split"]
    """(M,) those of the mesh."""
    faces: Int[np.ndarray, "faces 3"]
    """Indices of the M."""
    colors: UInt8[np.ndarray, "split 3"]


def split_colors(mesh: Mesh) -> SplitColors | None:
    """Splits the vertices of a mesh by the colours at the corners of its faces; None for one without colours."""
    if mesh.colors is None:
        return None
    corners = mesh.colors.reshape(-1, 3)
    red, green, blue = corners.astype(np.int64).T
    keys = (mesh.faces.reshape(-1).astype(np.int64) << 24) | (red << 16) | (green << 8) | blue
    kept, first, faces = np.unique(keys, return_index=True, return_inverse=True)
    return SplitColors(kept >> 24, faces.reshape(-1, 3), corners[first])
