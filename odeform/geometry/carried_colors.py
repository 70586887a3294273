"""Carries the colours of a shape to another mesh in the same place."""

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from odeform.types import GaussianSplats, Geometry, Mesh

__all__ = ["colored_like"]


def colored_like(mesh: Mesh, shape: Geometry) -> Mesh:
    """The mesh with the colours that `shape` has nearest to the middle of each face; as it is where that has none.

    Both are in the same place, in metres. What of the colours is finer than the mesh's faces is lost.
    """
    if isinstance(shape, Mesh):
        if shape.colors is None:
            return mesh
        places = np.asarray(shape.points, dtype=float)[shape.faces].mean(axis=1)
        colors = shape.colors.mean(axis=1)
    else:
        if shape.colors is None:
            return mesh
        places = np.asarray(shape.points, dtype=float)
        colors = 255.0 * shape.colors if isinstance(shape, GaussianSplats) else shape.colors
    middles = np.asarray(mesh.points, dtype=float)[mesh.faces].mean(axis=1)
    nearest = KDTree(places).query(middles)[1]
    faces = np.round(colors[nearest]).astype(np.uint8)
    return replace(mesh, colors=np.repeat(faces[:, None], 3, axis=1))
