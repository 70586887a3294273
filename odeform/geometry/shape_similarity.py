"""How far a shape is from the body that a model was trained on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import KDTree

from odeform.types import Floats, Geometry, Mesh, Points

__all__ = ["TOLERANCE", "ShapeSimilarity", "compare_shapes"]

TOLERANCE = 0.02
"""Fraction of the body's size within which a surface counts as the body's own. Coarser meshes, points and splats of the
trained ball measure 0.010 to 0.018; a ball that is 3 % flatter measures 0.03, a shoe 0.64. What a flatter ball does in
the simulator differs from the model's motion by about as much as the model's own error at 0.02, and by more beyond."""
FRACTION = 0.99  # of either surface that has to lie within the distance: scans and splats have stray points
SAMPLES = 4_000  # points of each surface that are compared
WIDEST = 0.1  # of the body's size: points farther apart than this do not show a surface
NEAREST = 4  # samples whose triangles are tried for the nearest point of a mesh


@dataclass(frozen=True)
class ShapeSimilarity:
    """The distance between two surfaces: 99 % of either lie within `distance` of the other, `mean` is their mean.

    Both in metres, the larger of both ways. Up to `tolerance`, in metres, shapes count as the same.
    """

    distance: float
    mean: float
    tolerance: float

    @property
    def same(self) -> bool:
        """Whether the shape counts as the body itself."""
        return self.distance <= self.tolerance

    def describe(self) -> str:
        """Describes it in one sentence, for people."""
        if self.same:
            return f"the shape is the trained body's, to within {1e3 * self.distance:.1f} mm"
        return (
            f"this shape was not trained: its surface is on average {1e3 * self.mean:.0f} mm "
            f"from the trained body's, at most {1e3 * self.distance:.0f} mm"
        )


def compare_shapes(geometry: Geometry, bodies: Sequence[Mesh]) -> ShapeSimilarity:
    """The similarity of a shape to the most similar of `bodies`, as all of them lie in the scene."""
    return min((_compare(geometry, body) for body in bodies), key=lambda similarity: similarity.distance)


def _compare(geometry: Geometry, body: Mesh) -> ShapeSimilarity:
    tolerance = TOLERANCE * float(np.ptp(body.points, axis=0).max())
    if geometry is body:
        return ShapeSimilarity(0.0, 0.0, tolerance)
    widest = WIDEST / TOLERANCE * tolerance
    ways = _distances(_samples(geometry)[0], body, widest), _distances(_samples(body)[0], geometry, widest)
    return ShapeSimilarity(
        max(float(np.quantile(way, FRACTION)) for way in ways), max(float(way.mean()) for way in ways), tolerance
    )


def _samples(geometry: Geometry) -> tuple[Points, np.ndarray]:
    """Points (S, 3) spread over a surface, and the face of each; of unconnected points, some of them, and no faces."""
    points = np.asarray(geometry.points, dtype=float)
    if not isinstance(geometry, Mesh) or not len(geometry.faces):
        chosen = np.linspace(0, len(points) - 1, min(SAMPLES, len(points))).astype(int)
        return points[chosen], np.zeros(0, dtype=int)
    corners = points[geometry.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    fraction = (np.arange(SAMPLES) + 0.5) / SAMPLES
    face = np.minimum(np.searchsorted(np.cumsum(area), fraction * area.sum()), len(area) - 1)
    # uniform in a triangle: Turk, Generating random points in triangles (Graphics Gems, 1990)
    rng = np.random.default_rng(0)
    root, along = np.sqrt(rng.random((SAMPLES, 1))), rng.random((SAMPLES, 1))
    weights = np.concatenate([1.0 - root, root * (1.0 - along), root * along], axis=1)
    return np.einsum("sk,ski->si", weights, corners[face]), face


def _distances(points: Points, shape: Geometry, widest: float) -> Floats:
    """(S,) distance of each point from a surface; from unconnected points less their spacing, if below `widest` m."""
    samples, face = _samples(shape)
    tree = KDTree(samples)
    if not len(face):
        away, _ = tree.query(points)
        spacing, _ = tree.query(samples, k=min(4, len(samples)))
        spacing = float(np.median(spacing.reshape(len(samples), -1)[:, -1]))
        return np.maximum(away - min(spacing, widest), 0.0)
    assert isinstance(shape, Mesh)
    count = min(NEAREST, len(samples))
    _, near = tree.query(points, k=count)
    triangles = np.asarray(shape.points, dtype=float)[shape.faces[face[np.ravel(near)]]]
    repeated = np.repeat(points, count, axis=0)
    away = np.linalg.norm(trimesh.triangles.closest_point(triangles, repeated) - repeated, axis=1)
    return away.reshape(-1, count).min(axis=1)
