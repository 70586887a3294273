"""Even triangles on a closed surface.

Vertices of a fine mesh are clustered, and the dual of the clusters is the new mesh (Valette and Chassery 2004,
"Approximated centroidal Voronoi diagrams for uniform polygonal mesh coarsening").
"""

import numpy as np
from scipy.spatial import KDTree

from odeform.geometry.normals import vertex_normals
from odeform.geometry.shape import surface_weights
from odeform.types import Faces, Floats, Ints, Mesh

__all__ = ["remesh"]

ITERATIONS = 30
SPREAD = 0.5  # weight of the normals, in edge lengths: clusters neither cross thin parts nor bend around edges


def remesh(fine: Mesh, count: int, seed: int = 0) -> Mesh:
    """A mesh of about `count` vertices, from one with at least five times as many. It may have defects."""
    points = np.asarray(fine.points, dtype=float)
    weights = surface_weights(fine)
    area = 0.5 * np.linalg.norm(_areas(points, fine.faces), axis=1).sum()
    edge = np.sqrt(area / count)
    normals = vertex_normals(points, fine.faces)
    features = np.concatenate([points, SPREAD * edge * normals], axis=1)
    rng = np.random.default_rng(seed)
    centres = features[rng.choice(len(points), count, replace=False, p=weights)]
    for _ in range(ITERATIONS):
        labels = np.asarray(KDTree(centres).query(features)[1])
        centres = _means(features, weights, labels, count, centres)
    labels = np.asarray(KDTree(centres).query(features)[1])
    return _dual(fine.faces, labels, _means(points, weights, labels, count, centres[:, :3]))


def _means(values: Floats, weights: Floats, labels: Ints, count: int, empty: Floats) -> Floats:
    total = np.bincount(labels, weights, count)
    sums = np.stack([np.bincount(labels, weights * column, count) for column in values.T], axis=1)
    return np.where(total[:, None] > 0.0, sums / np.maximum(total, 1e-30)[:, None], empty)


def _areas(points: Floats, faces: Faces) -> Floats:
    a, b, c = (points[faces[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def _dual(faces: Faces, labels: Ints, centres: Floats) -> Mesh:
    triangles = labels[faces]
    between = (np.diff(np.sort(triangles, axis=1), axis=1) > 0).all(axis=1)
    triangles = triangles[between]
    _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    used, position = np.unique(triangles[np.sort(first)], return_inverse=True)
    return Mesh(centres[used], position.reshape(-1, 3).astype(np.int32))
