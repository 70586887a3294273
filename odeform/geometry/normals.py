"""Surface normals, at the vertices of a mesh and at points near it."""

import numpy as np
import trimesh
from scipy.spatial import KDTree

from odeform.types import Faces, Floats, Ints, Mesh, Points

__all__ = ["nearest_normals", "vertex_normals"]


def vertex_normals(points: Points, faces: Faces) -> Points:
    """(N, 3) area-weighted unit normals at the vertices `points` (N, 3); zero where all faces have no area."""
    corners = points[faces]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros_like(points)
    for corner in range(3):
        np.add.at(total, faces[:, corner], face)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-20)


def nearest_normals(surface: Mesh, points: Points) -> Points:
    """Computes (M, 3) unit normals of `surface` at its points nearest to `points` (M, 3), interpolated over the faces.

    The nearest point is searched on the faces around the nearest vertex. +z where the surface has no normal.
    """
    vertices, points = np.asarray(surface.points, dtype=float), np.asarray(points, dtype=float)
    normals = vertex_normals(vertices, surface.faces)
    # vertices that coincide, as along texture seams, count as one
    unique, corner = np.unique(vertices[surface.faces].reshape(-1, 3), axis=0, return_inverse=True)
    nearest = KDTree(unique).query(points)[1]
    distance, found = np.full(len(points), np.inf), np.zeros_like(points)
    for face in _faces_around(corner.reshape(-1, 3), len(unique))[nearest].T:
        corners = vertices[surface.faces[face]]
        foot = trimesh.triangles.closest_point(corners, points)
        away = ((foot - points) ** 2).sum(axis=1)
        closer = np.flatnonzero(away < distance)
        distance[closer] = away[closer]
        barycentric = _barycentric(corners[closer], foot[closer])
        found[closer] = np.einsum("nc,nci->ni", barycentric, normals[surface.faces[face[closer]]])
    size = np.linalg.norm(found, axis=1, keepdims=True)
    return np.where(size > 1e-6, found / np.maximum(size, 1e-6), (0.0, 0.0, 1.0))


def _faces_around(faces: Faces, count: int) -> Ints:
    """(count, K) faces at each vertex, of which each has at least one; shorter rows repeat their first."""
    corners = faces.ravel()
    degree = np.bincount(corners, minlength=count)
    first, column = np.cumsum(degree) - degree, np.arange(degree.max())
    return np.argsort(corners)[first[:, None] + np.where(column < degree[:, None], column, 0)] // 3


def _barycentric(corners: Floats, points: Points) -> Points:
    """(M, 3) barycentric coordinates of `points` in triangles (M, 3, 3); equal where a triangle has no area."""
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = trimesh.triangles.points_to_barycentric(corners, points)
    return np.where(np.isfinite(weights).all(axis=1, keepdims=True), weights, 1.0 / 3.0)
