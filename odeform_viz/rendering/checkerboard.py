"""A checkerboard on a mesh, which makes its rotation visible: alternating cubes, cut exactly along their planes."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from odeform.types import Faces, Floats, Ints, Mesh, Points

__all__ = ["Part", "checkerboard_parts"]

CELLS = 6  # along the longest side of a mesh
TOLERANCE = 1e-6  # of the mesh's size; vertices this close to a plane count as lying in it


@dataclass(frozen=True, eq=False)
class Part:
    """Some cubes of a mesh: `faces` (F, 3) index the part's own M vertices.

    The vertices are a linear combination of the N of the mesh: `weights` (M, N), each row summing to 1.
    """

    weights: sparse.csr_array
    faces: Ints

    def vertices(self, points: Points) -> Points:
        """Returns the part's vertices (M, 3) for mesh vertices `points` (N, 3), in their units."""
        return self.weights @ points


def checkerboard_parts(mesh: Mesh) -> list[Part]:
    """Split a mesh into two parts of alternating cubes around its centre; empty parts are left out."""
    points = np.asarray(mesh.points, dtype=float)
    low, high = points.min(axis=0), points.max(axis=0)
    centre, size = 0.5 * (low + high), float((high - low).max())
    cell, weights, faces = size / CELLS, _identity(len(points)), mesh.faces
    for axis in range(3):
        last = int(0.5 * (high - low)[axis] / cell)
        for plane in centre[axis] + cell * np.arange(-last, last + 1):
            height = weights @ (points[:, axis] - plane)
            weights, faces = _cut(weights, faces, np.where(np.abs(height) < TOLERANCE * size, 0.0, height))
    cubes = np.floor(((weights @ points)[faces].mean(axis=1) - centre) / cell).astype(int)
    odd = cubes.sum(axis=1) % 2 == 1
    parts = []
    for chosen in (faces[odd], faces[~odd]):
        used, local = np.unique(chosen, return_inverse=True)
        parts.append(Part(weights[used], local.reshape(-1, 3)))
    return [part for part in parts if len(part.faces)]


def _identity(count: int) -> sparse.csr_array:
    each = np.arange(count)
    return sparse.csr_array((np.ones(count, dtype=np.float32), (each, each)), shape=(count, count))


def _cut(weights: sparse.csr_array, faces: Faces, height: Floats) -> tuple[sparse.csr_array, Ints]:
    """Split the faces that cross `height` (N,) zero, with new vertices on their edges."""
    side = np.sign(height[faces])
    crossed = (side.min(axis=1) < 0.0) & (side.max(axis=1) > 0.0)
    if not crossed.any():
        return weights, faces
    # rotate each face so that its first vertex lies in the plane, or else is the only one on its side
    first = np.where(
        (side == 0.0).any(axis=1), (side == 0.0).argmax(axis=1), (side == -side.sum(axis=1)[:, None]).argmax(axis=1)
    )
    rotated = np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)[crossed]
    edges = np.concatenate([rotated[:, [0, 1]], rotated[:, [0, 2]], rotated[:, [1, 2]]])
    edges = np.unique(np.sort(edges[height[edges].prod(axis=1) < 0.0], axis=1), axis=0)
    part = (height[edges[:, 0]] / (height[edges[:, 0]] - height[edges[:, 1]])).astype(np.float32)
    added = sparse.diags_array(1.0 - part) @ weights[edges[:, 0]] + sparse.diags_array(part) @ weights[edges[:, 1]]
    number = {(a, b): len(height) + index for index, (a, b) in enumerate(edges.tolist())}
    pieces = [faces[~crossed]]
    for a, b, c in rotated.tolist():
        if height[a] == 0.0:
            m = number[min(b, c), max(b, c)]
            pieces.append(np.array([[a, b, m], [a, m, c]]))
        else:
            m, n = number[min(a, b), max(a, b)], number[min(a, c), max(a, c)]
            pieces.append(np.array([[a, m, n], [m, b, c], [m, c, n]]))
    return sparse.csr_array(sparse.vstack([weights, added])), np.concatenate(pieces)
