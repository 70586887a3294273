"""A block of tetrahedra between two corners."""

from itertools import permutations

import numpy as np

from odeform.types import Floats, Ints, Points

__all__ = ["block"]


def block(low: Floats, high: Floats, counts: tuple[int, int, int]) -> tuple[Points, Ints]:
    """Nodes (N, 3) and tetrahedra (M, 4) of a block from `low` (3,) to `high` (3,), of so many cells along each axis; a
    cell is six tetrahedra around its diagonal, mirrored from cell to cell, so that the block has no preferred side."""
    shape = np.asarray(counts) + 1
    ticks = [np.linspace(a, b, n) for a, b, n in zip(low, high, shape, strict=True)]
    points = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(shape)
    cells = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    odd = cells % 2
    found = []
    for order in permutations(range(3)):
        at = np.zeros((len(cells), 4, 3), dtype=int)
        for step, axis in enumerate(order):
            at[:, step + 1 :, axis] = 1
        corners = cells[:, None] + np.where(odd[:, None] == 1, 1 - at, at)
        found.append(number[tuple(np.moveaxis(corners, -1, 0))])
    return points, np.concatenate(found)
