"""Fewer tetrahedra in the same solid: edges collapse as long as the surface stays in place.

As Cutler et al. 2004, "Simplification and improvement of tetrahedral models for simulation": the shortest edges first,
each only if no tetrahedron around it becomes too flat.
"""

import numpy as np

from odeform.geometry.solids.compiled_collapse import MOST, collapse_edges, improve_nodes
from odeform.geometry.solids.projection import QUALITY, projected
from odeform.geometry.solids.sampled import Sampled
from odeform.geometry.solids.tetrahedra import boundary, edges_of
from odeform.types import Floats, Ints, Perpoint, Points

__all__ = ["Coarsening"]

TOLERANCES = (0.002, 0.004, 0.006, 0.009, 0.013)  # of the longest extent, by which the surface may be off
LONGEST = 5.0  # times the first edges
GROWTH = 1.35  # of the edges that collapse, from one pass to the next
GOOD, SWEEPS = 0.45, 2  # quality from which on nodes stay, and times that all others are moved
STEPS = np.concatenate([width * np.concatenate([np.eye(3), -np.eye(3)]) for width in (0.06, 0.2)])
"""Relative to the shortest edge."""


class Coarsening:
    """Tetrahedra (M, 4) of nodes (N, 3), inside of a signed distance, that become fewer and better."""

    def __init__(self, points: Points, elements: Ints, distance: Sampled) -> None:
        self.points = np.array(points, dtype=float, order="C")
        self._tetrahedra = np.array(elements, dtype=np.int64, order="C")
        self._alive = np.ones(len(elements), dtype=bool)
        self._outer = np.zeros(len(points), dtype=bool)
        self._outer[boundary(elements)] = True
        corner = np.argsort(self._tetrahedra.ravel(), kind="stable")
        node = self._tetrahedra.ravel()[corner]
        self._counts = np.bincount(node, minlength=len(points))
        self._around = np.zeros((len(points), max(MOST, int(self._counts.max()))), dtype=np.int64)
        self._around[node, np.arange(len(node)) - (np.cumsum(self._counts) - self._counts)[node]] = corner // 4
        self._distance = distance
        self._first = float(np.median(self._lengths(edges_of(elements))))

    @property
    def elements(self) -> Ints:
        """(M, 4) those that are left."""
        return self._tetrahedra[self._alive]

    @property
    def count(self) -> int:
        """The number of nodes that are left."""
        return int((self._counts > 0).sum())

    def collapse(self, count: int) -> None:
        """Collapse edges until `count` nodes are left; there are more if the surface would be off too far."""
        size = float(np.ptp(self.points, axis=0).max())
        for tolerance in TOLERANCES:
            self.improve(1)
            reach = self._first
            while self.count > count and reach < LONGEST * self._first:
                edges = edges_of(self.elements)
                length = self._lengths(edges)
                short = edges[np.argsort(length)][: int((length < reach).sum())]
                limits = (tolerance * size, QUALITY, LONGEST * self._first)
                spare = self.count - count
                state = (self.points, self._tetrahedra, self._alive, self._around, self._counts, self._outer)
                collapse_edges(*state, short, self._field, limits, spare)
                reach *= GROWTH

    def improve(self, sweeps: int = SWEEPS) -> None:
        """Move nodes so that their worst tetrahedra become better; the surface stays where it is."""
        state = (self.points, self._tetrahedra, self._around, self._counts, self._outer)
        for _ in range(sweeps):
            improve_nodes(*state, self._field, GOOD, STEPS)

    def project(self, distance: Sampled) -> None:
        """Move the surface onto that of another distance, as far as tetrahedra stay sound."""
        used = np.unique(self.elements)
        outer = used[self._outer[used]]
        self._distance = distance
        self.points[:] = projected(self.points, self.elements, outer, distance)

    def _lengths(self, edges: Ints) -> Perpoint:
        return np.linalg.norm(self.points[edges[:, 0]] - self.points[edges[:, 1]], axis=1)

    @property
    def _field(self) -> tuple[Floats, Floats, float]:
        distance = self._distance
        return np.ascontiguousarray(distance.values), np.asarray(distance.origin, dtype=float), distance.cell
