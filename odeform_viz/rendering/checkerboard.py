"""A pattern on a mesh that shows how it turns: its octants in turn, cut cleanly whatever its triangles."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from odeform.types import Faces, Floats, Ints, Mesh, Points

__all__ = ["Part", "checkerboard_parts"]

ON = 1e-6  # of the body's size; a vertex so near a plane lies in it


@dataclass(frozen=True, eq=False)
class Part:
    """Some octants of a mesh: its `faces` (F, 3) index vertices that `mix` (M, N) makes of the mesh's (N, 3)."""

    mix: sparse.csr_array
    faces: Ints

    def of(self, points: Points) -> Points:
        """(M, 3) where the part's vertices are when the mesh's are at `points` (N, 3)."""
        return self.mix @ points


def checkerboard_parts(mesh: Mesh) -> list[Part]:
    """A mesh in two parts, octants about its centre in turn. A body of one colour hides how it turns."""
    points = np.asarray(mesh.points, dtype=float)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    near = ON * float(np.ptp(points, axis=0).max())
    mix, faces = _identity(len(points)), mesh.faces
    for axis in range(3):
        height = mix @ (points[:, axis] - centre[axis])
        mix, faces = _cut(mix, faces, np.where(np.abs(height) < near, 0.0, height))
    odd = np.prod((mix @ points)[faces].mean(axis=1) - centre, axis=1) > 0.0
    parts = []
    for chosen in (faces[odd], faces[~odd]):
        used, local = np.unique(chosen, return_inverse=True)
        parts.append(Part(mix[used], local.reshape(-1, 3)))
    return [part for part in parts if len(part.faces)]


def _identity(count: int) -> sparse.csr_array:
    each = np.arange(count)
    return sparse.csr_array((np.ones(count, dtype=np.float32), (each, each)), shape=(count, count))


def _cut(mix: sparse.csr_array, faces: Faces, height: Floats) -> tuple[sparse.csr_array, Ints]:
    """Split the faces that cross height (N,) zero, with new vertices on their edges."""
    side = np.sign(height[faces])
    crossed = (side.min(axis=1) < 0.0) & (side.max(axis=1) > 0.0)
    if not crossed.any():
        return mix, faces
    # the vertex to turn to the front: one that lies in the plane, else the one that is alone on its side
    first = np.where(
        (side == 0.0).any(axis=1), (side == 0.0).argmax(axis=1), (side == -side.sum(axis=1)[:, None]).argmax(axis=1)
    )
    turned = np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)[crossed]
    edges = np.concatenate([turned[:, [0, 1]], turned[:, [0, 2]], turned[:, [1, 2]]])
    edges = np.unique(np.sort(edges[height[edges].prod(axis=1) < 0.0], axis=1), axis=0)
    share = (height[edges[:, 0]] / (height[edges[:, 0]] - height[edges[:, 1]])).astype(np.float32)
    fresh = sparse.diags_array(1.0 - share) @ mix[edges[:, 0]] + sparse.diags_array(share) @ mix[edges[:, 1]]
    count = len(height)
    number = {(a, b): count + index for index, (a, b) in enumerate(edges.tolist())}
    pieces = [faces[~crossed]]
    for a, b, c in turned.tolist():
        if height[a] == 0.0:
            m = number[min(b, c), max(b, c)]
            pieces.append(np.array([[a, b, m], [a, m, c]]))
        else:
            m, n = number[min(a, b), max(a, b)], number[min(a, c), max(a, c)]
            pieces.append(np.array([[a, m, n], [m, b, c], [m, c, n]]))
    return sparse.csr_array(sparse.vstack([mix, fresh])), np.concatenate(pieces)
