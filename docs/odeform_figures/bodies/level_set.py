"""Closed surfaces of solids that are given by a signed distance."""

from collections.abc import Callable

import manifold3d
import numpy as np

from odeform.types import Floats, Ints, Mesh, Perpoint, Points

__all__ = ["surface_of"]

HALF_WIDTH = 0.4  # m; a solid lies within this distance of the origin along each axis
COARSE = 0.012  # m, spacing of the grid that finds its extent


def surface_of(distance: Callable[[Points], Perpoint], edge: float) -> Mesh:
    """Makes the surface at distance 0, watertight and outward, with edges up to about `edge` metres.

    `distance` maps points (N, 3) m to signed distances (N,) m, negative inside. It is tabulated on a grid first:
    calling it for single points, as `manifold3d` does, takes a hundred times as long.
    """
    low, high = _extent(distance, 2.0 * edge)
    spacing = 0.5 * edge
    shape = np.ceil((high - low) / spacing).astype(int) + 1
    values = -distance(_grid(low, spacing, shape)).reshape(shape)
    corner, scale, last = low.tolist(), 1.0 / spacing, (shape - 2).tolist()

    def inside(x: float, y: float, z: float) -> float:
        u, v, w = (x - corner[0]) * scale, (y - corner[1]) * scale, (z - corner[2]) * scale
        i, j, k = (min(max(int(t), 0), end) for t, end in zip((u, v, w), last, strict=True))
        cell = values[i : i + 2, j : j + 2, k : k + 2]
        plane = cell[0] + (cell[1] - cell[0]) * min(max(u - i, 0.0), 1.0)
        line = plane[0] + (plane[1] - plane[0]) * min(max(v - j, 0.0), 1.0)
        return float(line[0] + (line[1] - line[0]) * min(max(w - k, 0.0), 1.0))

    solid = manifold3d.Manifold.level_set(inside, [*low, *high], edge, 0.0, -1.0).to_mesh()
    return Mesh(np.asarray(solid.vert_properties[:, :3], dtype=float), np.asarray(solid.tri_verts, dtype=np.int32))


def _extent(distance: Callable[[Points], Perpoint], margin: float) -> tuple[Floats, Floats]:
    """Corners (3,) m of a box around the solid."""
    low = np.full(3, -HALF_WIDTH)
    points = _grid(low, COARSE, np.full(3, int(2.0 * HALF_WIDTH / COARSE) + 1))
    near = points[distance(points) < COARSE]
    return near.min(axis=0) - COARSE - margin, near.max(axis=0) + COARSE + margin


def _grid(low: Floats, spacing: float, shape: Ints) -> Points:
    axes = [low[i] + spacing * np.arange(shape[i]) for i in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
