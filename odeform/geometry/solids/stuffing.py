"""Tetrahedra inside of a signed distance, well shaped by construction.

Labelle and Shewchuk 2007, "Isosurface stuffing: fast tetrahedral meshes with good dihedral angles". A body-centred
cubic lattice is cut at the surface; corners that are too near to it are moved onto it first.
"""

from collections.abc import Callable

import numpy as np

from odeform.geometry.solids.tetrahedra import edges_of, outward
from odeform.types import Floats, Ints, Perpoint, Points

__all__ = ["stuff"]

LONG, SHORT = 0.24999, 0.41189
"""Fractions of the lattice's long and short edges within which a corner is moved onto the surface (their table 1)."""
ROOT = 4  # steps of a search for the surface along an edge

Distance = Callable[[Points], Perpoint]


def stuff(distance: Distance, points: Points, tetrahedra: Ints) -> tuple[Floats, Ints]:
    """Nodes (N, 3) and tetrahedra (M, 4) of the inside of a signed distance, from those of a lattice around it."""
    values = distance(points)
    tetrahedra = tetrahedra[(values[tetrahedra] < 0.0).any(axis=1)]
    edges = edges_of(tetrahedra)
    edges = edges[(values[edges] < 0.0).sum(axis=1) == 1]
    edges = np.where(values[edges[:, :1]] < 0.0, edges, edges[:, ::-1])  # from the inside out
    cuts = _cuts(distance, points, values, edges)
    points, values = _moved(points, values, edges, cuts)
    crossed = (values[edges] != 0.0).all(axis=1)
    edges, cuts = edges[crossed], cuts[crossed]
    return _cut_up(points, values, tetrahedra, edges, cuts)


def _cuts(distance: Distance, points: Points, values: Perpoint, edges: Ints) -> Floats:
    """Where the surface crosses edges (E, 2), as fractions from their first, inner ends."""
    inner, outer = np.zeros(len(edges)), np.ones(len(edges))
    below, above = values[edges[:, 0]], values[edges[:, 1]]
    start, along = points[edges[:, 0]], points[edges[:, 1]] - points[edges[:, 0]]
    for _ in range(ROOT):
        at = inner + (outer - inner) * np.clip(below / (below - above), 0.1, 0.9)
        found = distance(start + at[:, None] * along)
        inside = found < 0.0
        inner, below = np.where(inside, at, inner), np.where(inside, found, below)
        outer, above = np.where(inside, outer, at), np.where(inside, above, found)
    return inner + (outer - inner) * below / (below - np.maximum(above, 1e-12))


def _moved(points: Points, values: Perpoint, edges: Ints, cuts: Floats) -> tuple[Points, Perpoint]:
    """Moves corners that are too near to a cut onto it, the nearest of each neighbourhood first; they then have the
    value 0."""
    points, values = points.copy(), values.copy()
    place = points[edges[:, 0]] + cuts[:, None] * (points[edges[:, 1]] - points[edges[:, 0]])
    length = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    limit = np.where(length > 0.95 * length.max(), LONG, SHORT)
    ends, away = edges.T.ravel(), np.concatenate([cuts, 1.0 - cuts]) / np.tile(limit, 2)
    other, where = edges[:, ::-1].T.ravel(), np.tile(place, (2, 1))
    open_ = np.ones(len(ends), dtype=bool)
    while (near := np.flatnonzero(open_ & (away < 1.0))).size:
        least = np.full(len(points), np.inf)
        np.minimum.at(least, ends[near], away[near])
        around = np.full(len(points), np.inf)
        np.minimum.at(around, other[open_], least[ends[open_]])
        chosen = near[(away[near] == least[ends[near]]) & (least[ends[near]] <= around[ends[near]])]
        points[ends[chosen]], values[ends[chosen]] = where[chosen], 0.0
        open_ &= (values[ends] != 0.0) & (values[other] != 0.0)
    return points, values


def _cut_up(points: Points, values: Perpoint, tetrahedra: Ints, edges: Ints, cuts: Floats) -> tuple[Floats, Ints]:
    """Cuts tetrahedra (M, 4) at the `edges` that cross the surface, and leaves what is outside out.

    Diagonals of cut sides start at the corner of theirs that comes first in the tetrahedra's order, which is the same
    in both neighbours.
    """
    place = points[edges[:, 0]] + cuts[:, None] * (points[edges[:, 1]] - points[edges[:, 0]])
    key = edges[:, 0] * len(points) + edges[:, 1]
    order = np.argsort(key)
    key = key[order]

    def cut(inner: Ints, outer: Ints) -> Ints:
        """The new node between an inner and an outer corner, or the outer one itself if it is on the surface."""
        found = len(points) + order[np.minimum(np.searchsorted(key, inner * len(points) + outer), len(key) - 1)]
        return np.where(values[outer] == 0.0, outer, found)

    everywhere = np.concatenate([points, place])
    level = np.sign(values)
    rank = np.lexsort((np.arange(len(points)), level))
    position = np.empty(len(points), dtype=np.int64)
    position[rank] = np.arange(len(points))
    tetrahedra = rank[np.sort(position[tetrahedra], axis=1)]
    inside, outside = (level[tetrahedra] < 0.0).sum(axis=1), (level[tetrahedra] > 0.0).sum(axis=1)
    found: list[Ints] = [tetrahedra[(inside > 0) & (outside == 0)]]
    a, b, c, d = tetrahedra[(inside == 1) & (outside > 0)].T
    found.append(np.stack([a, cut(a, b), cut(a, c), cut(a, d)], axis=1))
    a, b, c, d = tetrahedra[(inside == 2) & (outside == 1)].T  # c is on the surface
    found += _stacked([a, b, cut(b, d), c], [a, cut(b, d), cut(a, d), c])
    a, b, c, d = tetrahedra[(inside == 2) & (outside == 2)].T
    ac, ad, bc, bd = cut(a, c), cut(a, d), cut(b, c), cut(b, d)
    first = np.linalg.norm(everywhere[ac] - everywhere[bd], axis=1) < np.linalg.norm(
        everywhere[ad] - everywhere[bc], axis=1
    )
    found += _stacked([a, b, bc, bd], [a, ac, ad, np.where(first, bd, bc)], [a, np.where(first, ac, ad), bd, bc])
    a, b, c, d = tetrahedra[(inside == 3) & (outside == 1)].T
    found += _stacked([a, b, c, cut(c, d)], [a, b, cut(b, d), cut(c, d)], [a, cut(a, d), cut(b, d), cut(c, d)])
    return everywhere, outward(everywhere, np.concatenate(found))


def _stacked(*corners: list[Ints]) -> list[Ints]:
    return [np.stack(one, axis=1) for one in corners]
