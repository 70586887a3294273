"""Subsets of geometries: split by a region, select by a mask, concatenate."""

from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.geometry.region import Mask, Region
from odeform.types import GaussianSplats, Geometry, Ints, Mesh, PointCloud

__all__ = ["concatenated", "most_visible", "split", "subset"]

Unstructured = TypeVar("Unstructured", bound=GaussianSplats | PointCloud)


def split(geometry: Geometry, region: Region) -> tuple[Geometry, Geometry | None]:
    """The part within a region and the remainder, None if it is empty.

    A mesh is split by faces: those with all corners within, and all others. Raises `InputError` if the part is empty.
    """
    inside = region.contains(geometry.points)
    if isinstance(geometry, Mesh):
        within = np.asarray(inside[geometry.faces].all(axis=1))
        if not within.any():
            raise InputError(f"the region contains none of the {len(within):,} faces; move it or make it larger")
        return _of_faces(geometry, within), None if within.all() else _of_faces(geometry, ~within)
    count = int(inside.sum())
    if count < 2 or np.ptp(geometry.points[inside], axis=0).max() <= 0.0:
        raise InputError(f"the region contains {count} of the {len(inside):,} points; move it or make it larger")
    return subset(geometry, inside), None if inside.all() else subset(geometry, ~inside)


def subset(geometry: Unstructured, kept: Mask | Ints | slice) -> Unstructured:
    """The points where `kept` (N,) is true, or with these indices, with their attributes; of a slice, views."""
    if not isinstance(geometry, GaussianSplats):
        colors = None if geometry.colors is None else geometry.colors[kept]
        return replace(geometry, points=geometry.points[kept], colors=colors)
    return replace(
        geometry,
        points=geometry.points[kept],
        covariances=geometry.covariances[kept],
        harmonics=geometry.harmonics[kept],
        opacities=geometry.opacities[kept],
    )


def concatenated(one: Geometry, other: Geometry | None) -> Geometry:
    """Both geometries as one, the points of `one` first; points alone where their kinds differ."""
    if other is None:
        return one
    points = np.concatenate([one.points, other.points])
    if isinstance(one, Mesh) and isinstance(other, Mesh):
        faces = np.concatenate([one.faces, other.faces + len(one.points)])
        return replace(one, points=points, faces=faces, colors=_both_colors(one, other))
    if isinstance(one, GaussianSplats) and isinstance(other, GaussianSplats):
        return replace(
            one,
            points=points,
            covariances=np.concatenate([one.covariances, other.covariances]),
            harmonics=np.concatenate([one.harmonics, other.harmonics]),
            opacities=np.concatenate([one.opacities, other.opacities]),
        )
    if isinstance(one, PointCloud) and isinstance(other, PointCloud):
        return replace(one, points=points, colors=_both_colors(one, other))
    return PointCloud(points, up=one.up, offset=one.offset)


def _both_colors(one: Mesh | PointCloud, other: Mesh | PointCloud) -> NDArray[np.uint8] | None:
    return None if one.colors is None or other.colors is None else np.concatenate([one.colors, other.colors])


def most_visible(splats: GaussianSplats, count: int) -> GaussianSplats:
    """The `count` splats that cover most of an image, by opacity times projected area; `notes` say so."""
    total = len(splats.points)
    if total <= count:
        return splats
    # the sum of the principal minors is about the squared product of the two longer axes
    trace = np.trace(splats.covariances, axis1=1, axis2=2)
    square = np.einsum("nij,nji->n", splats.covariances, splats.covariances)
    cover = splats.opacities * np.sqrt(np.maximum(trace**2 - square, 0.0))
    kept = np.zeros(total, dtype=bool)
    kept[np.argpartition(cover, total - count)[total - count :]] = True
    note = f"the {count:,} most visible of {total:,} splats"
    return replace(subset(splats, kept), notes=(*splats.notes, note))


def _of_faces(mesh: Mesh, kept: np.ndarray) -> Mesh:
    used, local = np.unique(mesh.faces[kept], return_inverse=True)
    colors = None if mesh.colors is None else mesh.colors[kept]
    return replace(mesh, points=mesh.points[used], faces=local.reshape(-1, 3), colors=colors)
