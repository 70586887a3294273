"""Shapes of two like bodies: the points of the one, then those of the other."""

from dataclasses import replace

import numpy as np
from jaxtyping import Int

from odeform.types import Faces, GaussianSplats, Geometry, Mesh

__all__ = ["are_twins", "half_of", "twin_faces", "twins_of"]


def twin_faces(faces: Faces, count: int) -> Int[np.ndarray, "both 3"]:
    """(2 F, 3) triangles of two bodies of `count` vertices each, from those of one, (F, 3)."""
    return np.concatenate([faces, faces + np.asarray(count, dtype=faces.dtype)])


def twins_of(geometry: Geometry) -> Geometry:
    """A shape of N points and another one in the same place: 2 N points."""
    points = np.concatenate([geometry.points] * 2)
    if isinstance(geometry, Mesh):
        colors = None if geometry.colors is None else np.concatenate([geometry.colors] * 2)
        return replace(geometry, points=points, faces=twin_faces(geometry.faces, len(geometry.points)), colors=colors)
    if isinstance(geometry, GaussianSplats):
        parts = {name: np.concatenate([getattr(geometry, name)] * 2) for name in SPLATS}
        return replace(geometry, points=points, **parts)
    colors = None if geometry.colors is None else np.concatenate([geometry.colors] * 2)
    return replace(geometry, points=points, colors=colors)


SPLATS = ("covariances", "harmonics", "opacities")


def are_twins(geometry: Geometry) -> bool:
    """Whether a shape is what `twins_of` returns."""
    count, odd = divmod(len(geometry.points), 2)
    if odd or not count:
        return False
    return np.array_equal(geometry.points[:count], geometry.points[count:])


def half_of(geometry: Geometry) -> Geometry:
    """The one shape of which `twins_of` makes a shape of 2 N points."""
    count = len(geometry.points) // 2
    points = geometry.points[:count]
    if isinstance(geometry, Mesh):
        half = len(geometry.faces) // 2
        colors = None if geometry.colors is None else geometry.colors[:half]
        return replace(geometry, points=points, faces=geometry.faces[:half], colors=colors)
    if isinstance(geometry, GaussianSplats):
        return replace(geometry, points=points, **{name: getattr(geometry, name)[:count] for name in SPLATS})
    return replace(geometry, points=points, colors=None if geometry.colors is None else geometry.colors[:count])
