"""Moves the surface of a solid onto that of a shape, as far as its tetrahedra stay sound."""

import numpy as np

from odeform.geometry.solids.sampled import Sampled
from odeform.geometry.solids.tetrahedra import edges_of, qualities
from odeform.types import Floats, Ints, Perpoint, Points

__all__ = ["QUALITY", "projected"]

STEPS = 8
QUALITY = 0.25  # of tetrahedra, 1 if regular: they get no worse than that
RETREATS = 6  # times that steps are taken back where they spoil a tetrahedron
STEEP = 0.4  # slope of the distance below which a node is in the middle of a wall, and stays


def projected(points: Points, elements: Ints, outer: Ints, distance: Sampled) -> Points:
    """The nodes (N, 3), those in `outer` as near to the distance 0 as tetrahedra (M, 4) allow; the others even out."""
    edges = edges_of(elements)
    inner = np.setdiff1d(np.arange(len(points)), outer)
    for step in range(STEPS):
        away, slope = distance(points[outer]), distance.slope(points[outer])
        steep = np.linalg.norm(slope, axis=1)
        along = np.where((steep > STEEP)[:, None], slope / np.maximum(steep, STEEP)[:, None] ** 2, 0.0)
        moves = np.zeros_like(points)
        moves[outer] = -away[:, None] * along / (STEPS - step) ** 0.5
        moves[inner] = 0.5 * (_means(points, edges) - points)[inner]
        points = _guarded(points, elements, moves)
    return points


def _means(points: Points, edges: Ints) -> Floats:
    """(N, 3) the mean of each node's neighbours, itself without any."""
    total = np.zeros_like(points)
    count = np.bincount(edges.ravel(), minlength=len(points))[:, None]
    for one, other in (edges.T, edges.T[::-1]):
        np.add.at(total, one, points[other])
    return np.where(count > 0, total / np.maximum(count, 1), points)


def _guarded(points: Points, elements: Ints, moves: Floats) -> Points:
    """Moves nodes, but for those that would make a tetrahedron worse than `QUALITY`, or worse than it is."""
    before = np.minimum(qualities(points, elements), QUALITY)
    fraction: Perpoint = np.ones(len(points))
    for retreat in range(RETREATS):
        bad = qualities(points + fraction[:, None] * moves, elements) < before
        if not bad.any():
            return points + fraction[:, None] * moves
        fraction[np.unique(elements[bad])] *= 0.5 if retreat < RETREATS // 2 else 0.0
    bad = qualities(points + fraction[:, None] * moves, elements) < before
    return points if bad.any() else points + fraction[:, None] * moves
