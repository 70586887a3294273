"""Meshes of simple shapes."""

import numpy as np
import trimesh

from odeform.types import Mesh

__all__ = ["octasphere"]


def octasphere(radius: float, segments: int) -> Mesh:
    """Makes a sphere of `radius` in m about the origin, each octant a triangle grid with `segments` edges per side: 4
    segments^2 + 2 vertices.

    Edges follow the three coordinate planes, so a pattern by octants has straight borders.
    """
    index = {(i, j): n for n, (i, j) in enumerate((i, j) for i in range(segments + 1) for j in range(segments + 1 - i))}
    grid = np.array([(i, j, segments - i - j) for i, j in index], dtype=float)
    faces = []
    for i, j in index:
        if i + j < segments:
            faces.append((index[i, j], index[i + 1, j], index[i, j + 1]))
        if i + j < segments - 1:
            faces.append((index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]))
    octants, corners = [], []
    for signs in np.stack(np.meshgrid([1, -1], [1, -1], [1, -1]), axis=-1).reshape(-1, 3):
        turned = np.array(faces) if signs.prod() > 0 else np.array(faces)[:, ::-1]
        octants.append(turned + len(grid) * len(corners))
        corners.append(grid * signs)
    joined = trimesh.Trimesh(np.concatenate(corners), np.concatenate(octants), process=False)
    joined.merge_vertices()
    unit = joined.vertices / np.linalg.norm(joined.vertices, axis=1, keepdims=True)
    return Mesh(radius * unit, np.asarray(joined.faces))
