"""Vertices that coincide become one, and large coordinates become small ones, before anything is single precision."""

from dataclasses import replace

import numpy as np
import trimesh

from odeform.types import Geometry, Mesh

__all__ = ["centred", "merged"]

UNIT = (1e-3, 1e6)
"""Largest coordinates for which trimesh merges vertices as they are."""
LOSS = 1e-5  # of the extent; single precision may round coordinates by as much


def centred(geometry: Geometry) -> Geometry:
    """A geometry whose points are relative to an `offset` where single precision would round them noticeably.

    Captures have the coordinates of a map: millions of metres, which single precision knows to half a metre.
    """
    points = geometry.points
    if points.dtype != np.float64 or not len(points):
        return geometry
    low, high = points.min(axis=0), points.max(axis=0)
    extent = float((high - low).max())
    lost = np.abs(points - points.astype(np.float32)).max()
    if not 0.0 < LOSS * extent < lost < np.inf:
        return geometry
    step = 10.0 ** np.floor(np.log10(extent))
    x, y, z = (float(f"{value:.15g}") for value in np.round(0.5 * (low + high) / step) * step)
    note = f"positions are relative to ({x:.15g}, {y:.15g}, {z:.15g}) of the file, whose coordinates are too large"
    return replace(geometry, points=points - (x, y, z), offset=(x, y, z), notes=(*geometry.notes, note))


def merged(mesh: Mesh) -> Mesh:
    """Vertices that coincide become one, and those of no face are left out.

    trimesh compares vertices as integers, which overflow far from the unit scale.
    """
    scale = float(np.abs(mesh.points).max(initial=0.0)) or 1.0
    scale = 1.0 if UNIT[0] < scale < UNIT[1] else scale
    made = trimesh.Trimesh(mesh.points / scale, mesh.faces, process=False)
    made.merge_vertices()
    return replace(mesh, points=np.asarray(made.vertices) * scale, faces=np.asarray(made.faces))
