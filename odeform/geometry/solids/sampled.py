"""A signed distance that is known on a grid."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from odeform.types import Floats, Ints, Perpoint, Points, Vector

__all__ = ["Enclosed", "Sampled", "grid_around"]

MARGIN = 5  # cells around what a grid holds
CELLS = 200_000  # of a grid, about
FINEST, COARSEST = 1.0 / 128.0, 1.0 / 48.0  # cell, relative to the longest side


@dataclass(frozen=True, eq=False)
class Sampled:
    """Values at the corners of cubic cells; between them they are interpolated."""

    values: Float[np.ndarray, "x y z"]
    """Signed distances, negative inside."""
    origin: Vector
    """(3,) position of the first corner."""
    cell: float
    """Length of a cell's side."""

    def __call__(self, points: Points) -> Perpoint:
        """(N,) values at points (N, 3)."""
        at = ((np.asarray(points, dtype=float) - self.origin) / self.cell).T
        return ndimage.map_coordinates(self.values, at, order=1, mode="nearest")

    def slope(self, points: Points) -> Points:
        """(N, 3) slopes at points (N, 3), over a cell to both sides."""
        steps = self.cell * np.eye(3)
        return np.stack([(self(points + step) - self(points - step)) / (2.0 * self.cell) for step in steps], axis=1)

    def with_values(self, values: Floats) -> "Sampled":
        """Takes other values (X, Y, Z) at the same corners."""
        return replace(self, values=values)

    @property
    def corners(self) -> Points:
        """(N, 3) positions, in the order of the flat values."""
        axes = [self.origin[i] + self.cell * np.arange(count) for i, count in enumerate(self.values.shape)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    @property
    def volume(self) -> float:
        """That of the inside. Cells that the surface crosses count in part."""
        return float(np.clip(0.5 - self.values / self.cell, 0.0, 1.0).sum()) * self.cell**3

    def indices(self, points: Points) -> Ints:
        """(N, 3) the corners nearest to points (N, 3), within the grid."""
        at = np.round((np.asarray(points, dtype=float) - self.origin) / self.cell).astype(int)
        return np.clip(at, 0, np.array(self.values.shape) - 1)

    def edge_distance(self, inside: Bool[np.ndarray, "x y z"]) -> Float[np.ndarray, "x y z"]:
        """The distance of each corner from the border between those inside and those outside."""
        outer, inner = (np.asarray(ndimage.distance_transform_edt(part)) for part in (~inside, inside))
        return self.cell * (np.where(inside, inner, outer) - 0.5)


@dataclass(frozen=True, eq=False)
class Enclosed:
    """What a shape encloses."""

    distance: Sampled
    notes: tuple[str, ...]
    """What was done to find it, in parts of a sentence."""


def grid_around(points: Points) -> Sampled:
    """A grid of about `CELLS` cells around points (N, 3), without values yet."""
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    size = float(extent.max())
    wanted = (float(np.prod(np.maximum(extent, 0.05 * size))) / CELLS) ** (1.0 / 3.0)
    cell = float(np.clip(wanted, FINEST * size, COARSEST * size))
    shape = np.ceil(extent / cell).astype(int) + 2 * MARGIN + 1
    return Sampled(np.zeros(shape), low - MARGIN * cell, cell)
