"""How deep points, and other closed surfaces, are inside a closed surface."""

import igl
import numpy as np

from odeform.types import Mesh, Perpoint, Points

__all__ = ["overlap", "signed_distances"]

INSIDE = 0.5  # winding number from which on a point is inside


def signed_distances(points: Points, mesh: Mesh) -> Perpoint:
    """(N,) m of points (N, 3) m from a closed mesh, negative inside of it."""
    corners, faces = np.asarray(mesh.points, dtype=float), np.asarray(mesh.faces, dtype=np.int64)
    at = np.asarray(points, dtype=float)
    inside = np.asarray(igl.fast_winding_number(corners, faces, at)) > INSIDE
    return np.sqrt(np.asarray(igl.point_mesh_squared_distance(at, corners, faces)[0])) * np.where(inside, -1.0, 1.0)


def overlap(one: Mesh, other: Mesh) -> float:
    """Metres by which vertices of one closed mesh are inside another one, at most, either way; 0 where none is, and for
    meshes without faces."""
    return max(_depth(one.points, other), _depth(other.points, one))


def _depth(points: Points, mesh: Mesh) -> float:
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    near = points[((points > low) & (points < high)).all(axis=1)]
    if not len(near) or not len(mesh.faces):
        return 0.0
    return max(-float(signed_distances(near, mesh).min()), 0.0)
