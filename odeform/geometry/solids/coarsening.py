"""Fewer tetrahedra in the same solid: edges collapse as long as the surface stays in place.

As Cutler et al. 2004, "Simplification and improvement of tetrahedral models for simulation": the shortest edges first,
each only if no tetrahedron around it becomes too flat.
"""

import numpy as np

from odeform.geometry.solids.sampled import Sampled
from odeform.geometry.solids.tetrahedra import boundary, edges_of
from odeform.types import Ints, Points

__all__ = ["coarsened"]

QUALITY = 0.25  # of tetrahedra, 1 if regular: they get no worse than that
TOLERANCES = (0.002, 0.004, 0.006, 0.009, 0.013)  # of the longest extent, by which the surface may be off
LONGEST = 5.0  # times the first edges
GROWTH = 1.35  # of the edges that collapse, from one pass to the next


def coarsened(points: Points, elements: Ints, distance: Sampled, count: int) -> tuple[Points, Ints]:
    """About `count` of the nodes (N, 3), and tetrahedra between them, of a solid inside of a signed distance.

    There are more if the surface would be off too far.
    """
    from odeform.geometry.solids.compiled_collapse import MOST, collapse_edges  # Numba takes a moment to import

    points, elements = np.ascontiguousarray(points), np.ascontiguousarray(elements, dtype=np.int64)
    size = float(np.ptp(points, axis=0).max())
    outer = np.zeros(len(points), dtype=bool)
    outer[boundary(elements)] = True
    corner = np.argsort(elements.ravel(), kind="stable")
    node = elements.ravel()[corner]
    counts = np.bincount(node, minlength=len(points))
    around = np.zeros((len(points), max(MOST, int(counts.max()))), dtype=np.int64)
    around[node, np.arange(len(node)) - (np.cumsum(counts) - counts)[node]] = corner // 4
    alive = np.ones(len(elements), dtype=bool)
    field = (np.ascontiguousarray(distance.values), np.ascontiguousarray(distance.origin, dtype=float), distance.cell)
    first = float(np.median(np.linalg.norm(points[elements[:, 0]] - points[elements[:, 1]], axis=1)))
    spare = int((counts > 0).sum()) - count
    for tolerance in TOLERANCES:
        reach, gone = first, 1
        while spare > 0 and (gone or reach < LONGEST * first):
            ends = edges_of(elements[alive])
            length = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
            short = ends[np.argsort(length)][: int((length < reach).sum())]
            limits = (tolerance * size, QUALITY, LONGEST * first)
            gone = collapse_edges(points, elements, alive, around, counts, outer, short, field, limits, spare)
            spare -= gone
            reach = min(GROWTH * reach, LONGEST * first) if gone < 0.1 * len(short) + 1 else reach
            if not gone and reach >= LONGEST * first:
                break
    return points, elements[alive]
