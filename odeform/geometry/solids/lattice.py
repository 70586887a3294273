"""A lattice of well shaped tetrahedra."""

import numpy as np

from odeform.types import Floats, Ints, Points

__all__ = ["cubic_lattice"]


def cubic_lattice(low: Floats, high: Floats, spacing: float) -> tuple[Points, Ints]:
    """Nodes (N, 3) and tetrahedra (M, 4) of a body-centred cubic lattice that fills a box; four tetrahedra are around
    each edge between two centres. `spacing` is their longest edge."""
    count = np.ceil((np.asarray(high) - low) / spacing).astype(int) + 1
    corner = np.arange(np.prod(count + 1)).reshape(count + 1)
    centre = corner.size + np.arange(np.prod(count)).reshape(count)
    steps = [np.stack(np.meshgrid(*map(np.arange, n), indexing="ij"), axis=-1) for n in (count + 1, count)]
    points = low + spacing * np.concatenate([steps[0].reshape(-1, 3), steps[1].reshape(-1, 3) + 0.5])
    found = []
    for axis in range(3):
        centres, side = np.moveaxis(centre, axis, 0), np.moveaxis(corner, axis, 0)[1:-1]
        first, second = centres[:-1].ravel(), centres[1:].ravel()
        ring = [one.ravel() for one in (side[:, :-1, :-1], side[:, 1:, :-1], side[:, 1:, 1:], side[:, :-1, 1:])]
        found += [np.stack([first, second, ring[at], ring[(at + 1) % 4]], axis=1) for at in range(4)]
    return points, np.concatenate(found)
