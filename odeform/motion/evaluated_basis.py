"""The basis on a geometry: what is computed once per geometry and azimuth."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from odeform.geometry.rigid import rotation_z
from odeform.geometry.shape import surface_weights
from odeform.motion.local_frames import Axes, LocalFrames, evaluate_local_frames
from odeform.motion.reduced_space import ReducedSpace, to_canonical
from odeform.types import GaussianSplats, Geometry, Ints, Mesh, Perpoint, PointCloud, Points

__all__ = ["STILL", "EvaluatedBasis", "evaluate_basis"]

STILL = 4  # rows of `EvaluatedBasis` that are not modes
CHUNK = 1 << 14  # points, or their coordinates, that are worked on at once: they stay in the cache


@dataclass(frozen=True, eq=False)
class EvaluatedBasis:
    """A geometry, where it lies in the scene at rest, and the basis on it; float32.

    `points` (N, 3) are as given, `rest` canonical. Properties that not all motions need are computed on demand.
    """

    geometry: Geometry
    space: ReducedSpace
    azimuth: float
    points: Points
    rest: Points
    rows: Float[np.ndarray, "rows entries"]
    """(4 + K, 3 N): shifts along the three axes, `rest`, and the modes. One product deforms and shifts a body."""
    reach: Float[np.ndarray, " modes"]
    """Largest displacement of any point by each mode."""
    areas: Perpoint
    """Fraction of the surface at each point."""

    @property
    def values(self) -> Float[np.ndarray, "modes entries"]:
        """(K, 3 N): the modes."""
        return self.rows[STILL:]

    def some(self, chosen: Ints) -> "EvaluatedBasis":
        """The basis on `chosen` (M,) of its points alone."""
        points = self.points[chosen]
        rows = self.rows.reshape(len(self.rows), -1, 3)[:, chosen].reshape(len(self.rows), -1)
        rest, areas = self.rest[chosen], self.areas[chosen]
        return replace(self, geometry=PointCloud(points), points=points, rest=rest, rows=rows, areas=areas)

    @cached_property
    def sides(self) -> Int[np.ndarray, "sides 2"]:
        """The points at both ends of each side of its faces; none of shapes without faces."""
        faces = self.geometry.faces if isinstance(self.geometry, Mesh) else np.empty((0, 3), dtype=int)
        return np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)

    @cached_property
    def gram(self) -> Float[np.ndarray, "modes modes"]:
        """Mean products of the modes over the surface: c gram c is the mean square displacement, m^2."""
        areas, modes = np.repeat(self.areas, 3).astype(np.float32), len(self.values)
        out = np.zeros((modes, modes))
        for at in range(0, len(areas), CHUNK):
            part = self.values[:, at : at + CHUNK]
            out += (part * areas[at : at + CHUNK]) @ part.T
        return out.astype(np.float32)

    @cached_property
    def local_frames(self) -> LocalFrames:
        """The axes at each point and how the basis moves them."""
        return evaluate_local_frames(self.rest, self.space)

    @cached_property
    def covariances(self) -> Axes:
        """(3, 3, N) covariances of splats in the axes of their local frames, m^2."""
        assert isinstance(self.geometry, GaussianSplats)
        axes = rotation_z(self.azimuth) @ self.local_frames.rest
        half = np.einsum("nik,lkn->iln", self.geometry.covariances, axes)
        return np.einsum("jin,iln->jln", axes, half).astype(np.float32)


def evaluate_basis(geometry: Geometry, space: ReducedSpace, azimuth: float) -> EvaluatedBasis:
    """Evaluate the basis on a geometry at rest in the scene, at an azimuth in radians."""
    rest = to_canonical(geometry.points, space.anchor, azimuth)
    points, (count, modes) = np.array(geometry.points, dtype=np.float32), (len(rest), space.basis.modes)
    rows = np.empty((STILL + modes, 3 * count), dtype=np.float32)
    values = rows[STILL:].reshape(modes, count, 3)
    space.basis.values(rest, out=values)
    rest = rest.astype(np.float32)
    rows[:3] = np.tile(np.eye(3, dtype=np.float32), count)
    rows[3] = rest.ravel()
    squares = (np.square(values[:, at : at + CHUNK]).sum(axis=2).max(axis=1) for at in range(0, count, CHUNK))
    reach = np.sqrt(np.max(list(squares), axis=0))
    return EvaluatedBasis(geometry, space, azimuth, points, rest, rows, reach, surface_weights(geometry))
