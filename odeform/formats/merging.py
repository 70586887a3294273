"""Vertices that coincide become one, and large coordinates become small ones, before anything is single precision."""

from dataclasses import replace

import numpy as np
from jaxtyping import Int

from odeform.types import Geometry, Ints, Mesh

__all__ = ["centred", "merged"]

UNIT = (1e-3, 1e6)
"""Largest coordinates that are rounded as they are."""
STEPS = 1e8  # of a unit
MIX = tuple(np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64))
SHIFT = np.uint64(31)
EPSILON = 2.0**-24  # relative, by which single precision rounds at most
LOSS = 1e-5  # of the extent; single precision may round coordinates by as much


def centred(geometry: Geometry) -> Geometry:
    """A geometry whose points are relative to an `offset` where single precision would round them noticeably.

    Captures have the coordinates of a map: millions of metres, which single precision knows to half a metre.
    """
    points = geometry.points
    if points.dtype != np.float64 or not len(points):
        return geometry
    # column by column, which NumPy does ten times faster than along the first axis
    low, high = (np.array([end(column) for column in points.T]) for end in (np.min, np.max))
    extent = float((high - low).max())
    if EPSILON * max(np.abs(low).max(), np.abs(high).max()) <= LOSS * extent:
        return geometry
    lost = np.abs(points - points.astype(np.float32)).max()
    if not 0.0 < LOSS * extent < lost < np.inf:
        return geometry
    step = 10.0 ** np.floor(np.log10(extent))
    x, y, z = (float(f"{value:.15g}") for value in np.round(0.5 * (low + high) / step) * step)
    note = f"positions are relative to ({x:.15g}, {y:.15g}, {z:.15g}) of the file, whose coordinates are too large"
    return replace(geometry, points=points - (x, y, z), offset=(x, y, z), notes=(*geometry.notes, note))


def merged(mesh: Mesh) -> Mesh:
    """Vertices that coincide become one, and those of no face are left out. The others keep their order.

    Coordinates coincide where they are equal after rounding to 1e-8, in units of the largest one where that is far from
    the unit scale.
    """
    scale = float(np.abs(mesh.points).max(initial=0.0)) or 1.0
    scale = 1.0 if UNIT[0] < scale < UNIT[1] else scale
    used = np.zeros(len(mesh.points), dtype=bool)
    used[mesh.faces] = True
    points = mesh.points if used.all() else mesh.points[used]
    first, same = _distinct(np.rint(np.asarray(points, dtype=float) * (STEPS / scale)).astype(np.int64))
    if used.all():
        return mesh if len(first) == len(points) else replace(mesh, points=points[first], faces=same[mesh.faces])
    place = np.cumsum(used) - 1
    return replace(mesh, points=points[first], faces=same[place[mesh.faces]])


def _distinct(rows: Int[np.ndarray, "rows 3"]) -> tuple[Ints, Ints]:
    """The first (M,) of all equal rows, in order, and the place (N,) of each row among them."""
    hashes = np.zeros(len(rows), np.uint64)
    for column, factor in zip(rows.view(np.uint64).T, MIX, strict=True):
        hashes = (hashes + column) * factor
        hashes ^= hashes >> SHIFT  # else the mirror image of a point has the same one
    order = np.argsort(hashes, kind="stable")
    fresh = np.ones(len(rows), dtype=bool)
    fresh[1:] = hashes[order[1:]] != hashes[order[:-1]]
    if fresh.all():
        return np.arange(len(rows)), np.arange(len(rows))
    equal = (rows[order[1:]] == rows[order[:-1]]).all(axis=1)
    if not (fresh[1:] | equal).all():  # two rows of one hash
        _, first, same = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        same = same.reshape(-1)
    else:
        first, same = order[fresh], np.empty(len(rows), np.int64)
        same[order] = np.cumsum(fresh) - 1
    in_file = np.argsort(first)
    rank = np.empty(len(first), np.int64)
    rank[in_file] = np.arange(len(first))
    return first[in_file], rank[same]
