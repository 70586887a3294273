"""How deep two closed surfaces are inside each other."""

import igl
import numpy as np

from odeform.types import Mesh, Points

__all__ = ["depth_inside", "overlap"]

INSIDE = 0.5  # winding number from which on a point is inside


def depth_inside(points: Points, mesh: Mesh) -> float:
    """Metres by which points (N, 3) m are inside a closed mesh, at most; 0 outside of it, and for one without faces."""
    corners = np.asarray(mesh.points, dtype=float)
    low, high = corners.min(axis=0), corners.max(axis=0)
    near = np.asarray(points, dtype=float)
    near = near[((near > low) & (near < high)).all(axis=1)]
    if not len(near) or not len(mesh.faces):
        return 0.0
    faces = np.asarray(mesh.faces, dtype=np.int64)
    inside = near[np.asarray(igl.fast_winding_number(corners, faces, near)) > INSIDE]
    if not len(inside):
        return 0.0
    return float(np.sqrt(np.max(igl.point_mesh_squared_distance(inside, corners, faces)[0])))


def overlap(one: Mesh, other: Mesh) -> float:
    """Metres by which vertices of one closed mesh are inside another, at most, either way."""
    return max(depth_inside(one.points, other), depth_inside(other.points, one))
