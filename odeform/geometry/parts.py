"""Parts of shapes: what lies within a region, what is left, and both together again."""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from odeform.errors import InputError
from odeform.geometry.region import Mask, Region
from odeform.types import GaussianSplats, Geometry, Mesh, PointCloud

__all__ = ["concatenated", "most_visible", "split", "subset"]

Bare = TypeVar("Bare", bound=GaussianSplats | PointCloud)


def split(geometry: Geometry, region: Region) -> tuple[Geometry, Geometry | None]:
    """What lies within a region, and the rest, None if there is none.

    Of a mesh the faces that lie within as a whole, and all others. `InputError` where nothing lies within.
    """
    inside = region.contains(geometry.points)
    if isinstance(geometry, Mesh):
        within = np.asarray(inside[geometry.faces].all(axis=1))
        if not within.any():
            raise InputError(f"the region holds none of the {len(within):,} faces; move it or make it larger")
        return _of_faces(geometry, within), None if within.all() else _of_faces(geometry, ~within)
    count = int(inside.sum())
    if count < 2 or np.ptp(geometry.points[inside], axis=0).max() <= 0.0:
        raise InputError(f"the region holds {count} of the {len(inside):,} points; move it or make it larger")
    return subset(geometry, inside), None if inside.all() else subset(geometry, ~inside)


def subset(geometry: Bare, kept: Mask) -> Bare:
    """The points of a mask, with all that they have."""
    if not isinstance(geometry, GaussianSplats):
        return replace(geometry, points=geometry.points[kept])
    return replace(
        geometry,
        points=geometry.points[kept],
        covariances=geometry.covariances[kept],
        harmonics=geometry.harmonics[kept],
        opacities=geometry.opacities[kept],
    )


def concatenated(one: Geometry, other: Geometry | None) -> Geometry:
    """Two parts of one shape as one, the points of `one` first."""
    if other is None:
        return one
    points = np.concatenate([one.points, other.points])
    if isinstance(one, Mesh) and isinstance(other, Mesh):
        return Mesh(points, np.concatenate([one.faces, other.faces + len(one.points)]))
    if isinstance(one, GaussianSplats) and isinstance(other, GaussianSplats):
        return replace(
            one,
            points=points,
            covariances=np.concatenate([one.covariances, other.covariances]),
            harmonics=np.concatenate([one.harmonics, other.harmonics]),
            opacities=np.concatenate([one.opacities, other.opacities]),
        )
    return PointCloud(points)


def most_visible(splats: GaussianSplats, most: int) -> GaussianSplats:
    """As many of the splats as told, those that cover most of a picture: by opacity times area; said in the notes."""
    count = len(splats.points)
    if count <= most:
        return splats
    # the principal minors sum up to about the square of the product of the two longer axes
    trace = np.trace(splats.covariances, axis1=1, axis2=2)
    square = np.einsum("nij,nji->n", splats.covariances, splats.covariances)
    cover = splats.opacities * np.sqrt(np.maximum(trace**2 - square, 0.0))
    kept = np.zeros(count, dtype=bool)
    kept[np.argpartition(cover, count - most)[count - most :]] = True
    note = f"the {most:,} most visible of {count:,} splats"
    return replace(subset(splats, kept), notes=(*splats.notes, note))


def _of_faces(mesh: Mesh, kept: np.ndarray) -> Mesh:
    used, local = np.unique(mesh.faces[kept], return_inverse=True)
    return Mesh(mesh.points[used], local.reshape(-1, 3))
