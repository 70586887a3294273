"""A recorded motion on a finer mesh of the same body, so that it looks no worse than a prediction beside it."""

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy import sparse
from scipy.spatial import KDTree

from odeform.types import Faces, Ints, Mesh, Perpoint, Points

__all__ = ["Refined", "refined"]

SAME = 0.03  # of the size; meshes of one body are not farther apart


@dataclass(frozen=True, eq=False)
class Refined:
    """A finer `mesh` of M vertices; displacements of the N coarser ones at `rest` are interpolated on their faces."""

    mesh: Mesh
    rest: Points
    weights: sparse.csr_array
    """(M, N), each row summing to 1."""

    def points(self, coarse: Points) -> Points:
        """The finer vertices (M, 3) m for the coarser ones (N, 3) m."""
        return (self.mesh.points + self.weights @ (coarse - self.rest)).astype(np.float32)

    def values(self, coarse: Perpoint) -> Perpoint:
        """(M,) values at the finer vertices for (N,) values at the coarser ones."""
        return self.weights @ coarse


def refined(coarse: Mesh, fine: Mesh) -> Refined | None:
    """None if `fine` has no more vertices than `coarse`, or is not the same body at rest."""
    if len(fine.points) <= len(coarse.points):
        return None
    points, faces = np.asarray(fine.points, dtype=float), np.asarray(coarse.faces)
    around = _faces_around(faces, len(coarse.points))[KDTree(coarse.points).query(points)[1]]
    corners = np.asarray(coarse.points, dtype=float)[faces[around]]
    shape = corners.shape[:2]
    flat = trimesh.triangles.points_to_barycentric(corners.reshape(-1, 3, 3), np.repeat(points, shape[1], axis=0))
    inside = np.nan_to_num(flat.reshape(*shape, 3), nan=-np.inf)
    best = inside.min(axis=2).argmax(axis=1)
    each = np.arange(len(points))
    weights = np.clip(inside[each, best], 0.0, None)
    weights /= weights.sum(axis=1, keepdims=True)
    apart = np.linalg.norm(np.einsum("mk,mki->mi", weights, corners[each, best]) - points, axis=1)
    if not apart.max() <= SAME * float(np.ptp(points, axis=0).max()):
        return None
    entries = (weights.ravel(), (np.repeat(each, 3), faces[around[each, best]].ravel()))
    return Refined(fine, coarse.points, sparse.csr_array(entries, shape=(len(points), len(coarse.points))))


def _faces_around(faces: Faces, count: int) -> Ints:
    """(N, K) the faces around each vertex; those of few faces are repeated."""
    order = np.argsort(faces.ravel(), kind="stable")
    number = np.bincount(faces.ravel(), minlength=count)
    first = np.concatenate([[0], np.cumsum(number)[:-1]])
    turn = np.arange(number.max())[None] % np.maximum(number, 1)[:, None]
    return order[np.minimum(first[:, None] + turn, len(order) - 1)] // 3
