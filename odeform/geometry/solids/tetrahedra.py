"""The boundary and the orientation of tetrahedra."""

import numpy as np
from jaxtyping import Bool
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from odeform.types import Faces, Floats, Ints, Points

__all__ = [
    "EDGES",
    "boundary",
    "edges_of",
    "inside_out",
    "keys_of",
    "largest_part",
    "outer_first",
    "outward",
    "pulled_apart",
    "qualities",
    "volumes",
]

EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])  # of a tetrahedron
PINCHED = 8  # rounds of pulling apart
SIDES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])  # of a tetrahedron, outward


def keys_of(corners: Ints) -> Ints:
    """(N,) one number for each edge (N, 2) or side (N, 3), whatever the order of its nodes; there are 2 million at
    most."""
    ordered = np.sort(corners, axis=1).astype(np.int64)
    return (ordered << (21 * np.arange(ordered.shape[1]))).sum(axis=1)


def edges_of(elements: Ints) -> Ints:
    """(E, 2) the edges of tetrahedra (M, 4) or triangles (M, 3), each once."""
    ends = elements[:, EDGES if elements.shape[1] == 4 else EDGES[[0, 1, 3]]].reshape(-1, 2)
    return ends[np.unique(keys_of(ends), return_index=True)[1]]


def boundary(elements: Ints) -> Faces:
    """(F, 3) sides that belong to one tetrahedron only, outward."""
    sides = elements[:, SIDES].reshape(-1, 3)
    _, first, count = np.unique(keys_of(sides), return_index=True, return_counts=True)
    return sides[np.sort(first[count == 1])]


def _neighbours(elements: Ints) -> tuple[Ints, Ints]:
    """Pairs of sides, as indices into M x 4, that two tetrahedra share."""
    keys = keys_of(elements[:, SIDES].reshape(-1, 3))
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(np.diff(keys[order]) == 0)
    return order[same], order[same + 1]


def volumes(points: Points, elements: Ints) -> Floats:
    """(M,) volumes of tetrahedra (M, 4) of points (N, 3), negative where they are inside out."""
    corners = points[elements]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0


def qualities(points: Points, elements: Ints) -> Floats:
    """(M,) volumes relative to the edges' lengths: 1 for a regular tetrahedron, negative if inside out."""
    ends = points[elements[:, EDGES]]
    squares = ((ends[:, :, 1] - ends[:, :, 0]) ** 2).sum(axis=2).mean(axis=1)
    return 6.0 * np.sqrt(2.0) * volumes(points, elements) / squares**1.5


def inside_out(points: Points, elements: Ints) -> Bool[np.ndarray, " elements"]:
    """(M,) which tetrahedra (M, 4) of points (N, 3) have a negative volume; triangles of shells have none."""
    if elements.shape[1] == 3:
        return np.zeros(len(elements), dtype=bool)
    return volumes(points, elements) < 0.0


def outward(points: Points, elements: Ints) -> Ints:
    """The tetrahedra (M, 4), none inside out."""
    return np.where(inside_out(points, elements)[:, None], elements[:, [0, 2, 1, 3]], elements)


def largest_part(points: Points, elements: Ints) -> Ints:
    """Chooses the tetrahedra (M, 4) of the part with the most volume; parts are joined by sides alone."""
    one, other = _neighbours(elements)
    links = coo_array((np.ones(len(one)), (one // 4, other // 4)), shape=(len(elements),) * 2)
    count, label = connected_components(links, directed=False)
    sizes = np.bincount(label, np.abs(volumes(points, elements)), count)
    return elements[label == int(sizes.argmax())]


def pulled_apart(points: Points, elements: Ints) -> tuple[Floats, Ints]:
    """The same tetrahedra (M, 4), joined by sides alone: where only a corner or an edge joined some, each side gets
    nodes of its own, so that the surface is one everywhere. Where an edge stays pinched, what is outermost goes."""
    for _ in range(PINCHED):
        points, elements = _reglued(points, elements)
        faces = boundary(elements)
        keys, count = np.unique(keys_of(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)), return_counts=True)
        if not (pinched := keys[count > 2]).size:
            break
        around = np.isin(keys_of(elements[:, EDGES].reshape(-1, 2)), pinched).reshape(-1, 6).any(axis=1)
        outside = np.bincount(elements.ravel(), np.isin(elements, faces).ravel(), len(points)) > 0
        # of what is around a pinched edge, those with most of their corners on the surface
        corners = outside[elements].sum(axis=1)
        elements = elements[~(around & (corners >= corners[around].max()))]
        elements = largest_part(points, elements)
    return points, elements


def _reglued(points: Points, elements: Ints) -> tuple[Floats, Ints]:
    """Gives each group of corners that sides join a node of its own."""
    one, other = _neighbours(elements)
    first, second = SIDES[one % 4], SIDES[other % 4]
    here, there = (elements[at // 4][np.arange(len(at))[:, None], side] for at, side in ((one, first), (other, second)))
    here, there = np.argsort(here, axis=1), np.argsort(there, axis=1)
    left = 4 * (one // 4)[:, None] + np.take_along_axis(first, here, axis=1)
    right = 4 * (other // 4)[:, None] + np.take_along_axis(second, there, axis=1)
    links = coo_array((np.ones(left.size), (left.ravel(), right.ravel())), shape=(elements.size,) * 2)
    count, label = connected_components(links, directed=False)
    node = np.zeros(count, dtype=np.int64)
    node[label] = elements.ravel()
    return points[node], label.reshape(-1, 4)


def outer_first(points: Points, elements: Ints) -> tuple[Floats, Ints, Faces]:
    """The nodes in use, those of the boundary first, with the tetrahedra (M, 4) and their boundary
    (F, 3) by their new numbers."""
    faces = boundary(elements)
    outer = np.unique(faces)
    order = np.concatenate([outer, np.setdiff1d(np.unique(elements), outer)])
    position = np.full(len(points), -1)
    position[order] = np.arange(len(order))
    return points[order], position[elements].astype(np.int32), position[faces].astype(np.int32)
