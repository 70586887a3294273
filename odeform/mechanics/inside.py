"""How far points are from the surface of a body that deforms, by a grid around the body at rest."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from odeform.geometry.solids.overlap import signed_distances
from odeform.types import Floats, Ints, Mesh, Points, Vector

__all__ = ["Inside", "inside_of"]

CELLS, AROUND = 48, 4  # along the longest side of the body, and around it
SWEEPS = 2  # times that the sample that carries a point is looked up
SMALL = 1e-9  # in place of 0 / 0


@dataclass(frozen=True, eq=False)
class Inside:
    """Signed distances around a body at rest, and which of its samples is the nearest there.

    A point near the body where it is deformed is carried back to the body at rest as its nearest sample moves and turns
    what is around it.
    """

    values: Float[np.ndarray, "x y z 4"]
    """Signed distance in m, negative inside, and its slope, at the corners of cubic cells."""
    owners: Int[np.ndarray, "x y z"]
    """The sample nearest to each corner."""
    origin: Vector
    """(3,) m: the first corner, from the mass centre."""
    cell: float
    """m, the side of a cell."""

    def met(
        self,
        places: Float[np.ndarray, "points 3"],
        samples: Float[np.ndarray, "samples 3"],
        moved: Float[np.ndarray, "samples 3"],
        turns: Float[np.ndarray, "samples 3 3"],
    ) -> tuple[Floats, Floats, Ints]:
        """Signed distances (P,) m of places (P, 3) m from a body that deforms, outward normals (P, 3), and the samples
        (P,) that carry them, all in axes of the body.

        `samples` are where they are at rest; where they are now is `moved`, and how they have turned `turns`.
        """
        back, owner = places, np.zeros(len(places), dtype=np.int64)
        for _ in range(SWEEPS):
            owner = self.owners[tuple(self._nearest(back).T)]
            back = samples[owner] + np.einsum("pji,pj->pi", turns[owner], places - moved[owner])
        values, away = self._interpolated(back)
        slope = values[:, 1:] / np.maximum(np.linalg.norm(values[:, 1:], axis=1, keepdims=True), SMALL)
        normal = np.einsum("pij,pj->pi", turns[owner], slope)
        return values[:, 0] + away, normal, owner

    def _at(self, points: Floats) -> Floats:
        """(P, 3) places on the grid in cells, within it."""
        at = (points - self.origin) / self.cell
        return np.clip(at, 0.0, np.array(self.owners.shape) - 1.0)

    def _nearest(self, points: Floats) -> Ints:
        return np.floor(self._at(points) + 0.5).astype(np.int64)

    def _interpolated(self, points: Floats) -> tuple[Floats, Floats]:
        """(P, 4) values, linear along each axis within cells, and how far points are outside of the grid (P,) m."""
        at = self._at(points)
        away = np.linalg.norm(points - (self.origin + self.cell * at), axis=1)
        first = np.minimum(at.astype(np.int64), np.array(self.owners.shape) - 2)
        part, out = at - first, np.zeros((len(points), 4))
        for corner in np.ndindex(2, 2, 2):
            weight = np.prod(np.where(corner, part, 1.0 - part), axis=1)
            out += weight[:, None] * self.values[tuple((first + corner).T)]
        return out, away


def inside_of(mesh: Mesh, samples: Points) -> Inside:
    """The grid of a closed mesh at rest, m from its mass centre, with samples (S, 3) m of its surface."""
    points = np.asarray(mesh.points, dtype=float)
    cell = float(np.ptp(points, axis=0).max()) / CELLS
    low, high = points.min(axis=0) - AROUND * cell, points.max(axis=0) + AROUND * cell
    axes = [low[axis] + cell * np.arange(int(np.ceil((high - low)[axis] / cell)) + 1) for axis in range(3)]
    shape, corners = tuple(map(len, axes)), np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    distances = signed_distances(corners, mesh).reshape(shape)
    slopes = np.stack(np.gradient(distances, cell), axis=-1)
    values = np.ascontiguousarray(np.concatenate([distances[..., None], slopes], axis=-1))
    owners = np.asarray(KDTree(samples).query(corners)[1]).reshape(shape)
    return Inside(values, owners, low, cell)
