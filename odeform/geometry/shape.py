"""Shapes: how much of a body each point stands for, and how a foreign shape comes to lie where a model expects one."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from odeform.types import GaussianSplats, Geometry, Mesh, Perpoint, Vector, Vectors

__all__ = ["Fit", "difference", "fit_to", "surface_shares"]


def surface_shares(geometry: Geometry) -> Perpoint:
    """(N,) share of the surface at each point, summing to 1: a third of the adjacent faces; equal for bare points."""
    count = len(geometry.points)
    if not isinstance(geometry, Mesh):
        return np.full(count, 1.0 / count)
    corners = np.asarray(geometry.points, dtype=float)[geometry.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    shares = np.bincount(geometry.faces.ravel(), np.repeat(area, 3), minlength=count)
    total = shares.sum()
    return shares / total if total > 0.0 else np.full(count, 1.0 / count)


@dataclass(frozen=True, eq=False)
class Fit:
    """A shape brought to the place and size of another: x -> factor * x + shift."""

    geometry: Geometry
    factor: float
    shift: Vector

    def undo(self, points: Vectors) -> Vectors:
        """Points (..., 3) of the fitted shape -> in the units and place of the file that it came from."""
        return (points - self.shift) / self.factor


def difference(geometry: Geometry, reference: Mesh) -> float:
    """Mean distance in metres between two shapes' points, nearest to nearest, the larger of both ways."""
    one, other = (np.asarray(shape.points, dtype=float) for shape in (geometry, reference))
    ways = (KDTree(other).query(one)[0].mean(), KDTree(one).query(other)[0].mean())
    return float(max(ways))


def fit_to(geometry: Geometry, reference: Mesh) -> Fit:
    """Scale and shift a shape to the largest extent of `reference` and its footprint, standing on the same floor."""
    points, target = np.asarray(geometry.points, dtype=float), np.asarray(reference.points, dtype=float)
    low, high = points.min(axis=0), points.max(axis=0)
    extent = float((high - low).max())
    factor = float(np.ptp(target, axis=0).max()) / extent if extent > 0.0 else 1.0
    foot = np.array([*(0.5 * (low + high))[:2], low[2]]) * factor
    goal = np.array([*(0.5 * (target.min(axis=0) + target.max(axis=0)))[:2], target[:, 2].min()])
    moved = (points * factor + (goal - foot)).astype(np.float32)
    if isinstance(geometry, GaussianSplats):
        fitted: Geometry = replace(geometry, points=moved, covariances=geometry.covariances * factor**2)
    else:
        fitted = replace(geometry, points=moved)
    return Fit(fitted, factor, goal - foot)
