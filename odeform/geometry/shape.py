"""Shapes: how much of a body each point stands for, and how a foreign shape comes to lie where a model expects one."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from odeform.geometry.parts import joined, split
from odeform.geometry.region import Region
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.types import Floats, GaussianSplats, Geometry, Mesh, Perpoint, Points, Rotations

__all__ = ["Fit", "difference", "fit_to", "surface_shares", "together"]

SURROUNDED = 0.2  # of a unit vector: what surrounds a part evenly tells no direction


def surface_shares(geometry: Geometry) -> Perpoint:
    """(N,) share of the surface at each point, summing to 1: a third of the adjacent faces; equal for bare points."""
    count = len(geometry.points)
    if not isinstance(geometry, Mesh):
        return np.full(count, 1.0 / count)
    corners = np.asarray(geometry.points, dtype=float)[geometry.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    shares = np.bincount(geometry.faces.ravel(), np.repeat(area, 3), minlength=count)
    total = shares.sum()
    return shares / total if total > 0.0 else np.full(count, 1.0 / count)


@dataclass(frozen=True, eq=False)
class Fit:
    """A shape, or the part of it within a region, brought to where a body lies."""

    source: Geometry
    """The whole shape, as in its file."""
    region: Region | None
    """What moves of it, in the units of the file; None for all."""
    place: Similarity
    """From the units and place of the file to those of the scene."""
    geometry: Geometry
    """What moves, as it lies at rest."""
    left: Geometry | None
    """What stands still, as in the file; None if all moves."""
    lift: float
    """Metres by which a body that is dropped starts above what stands still."""
    origin: str = ""
    """The file, or the bundled shape, that the source was read from; empty where it can be read from neither."""

    @cached_property
    def still(self) -> Geometry | None:
        """What stands still, where it lies in the scene."""
        return None if self.left is None else self.place.shape(self.left)

    def undo(self, moved: Geometry) -> Geometry:
        """What moves, at whatever moment, in the units and place of the file, and with it what stands still."""
        return joined(self.place.inverse.shape(moved), self.left)


def difference(geometry: Geometry, reference: Mesh) -> float:
    """Mean distance in metres between two shapes' points, nearest to nearest, the larger of both ways."""
    one, other = (np.asarray(shape.points, dtype=float) for shape in (geometry, reference))
    ways = (KDTree(other).query(one)[0].mean(), KDTree(one).query(other)[0].mean())
    return float(max(ways))


def fit_to(
    geometry: Geometry,
    reference: Mesh,
    region: Region | None = None,
    rotation: Rotations | None = None,
    place: Similarity | None = None,
) -> Fit:
    """Bring a shape, or the part of it within `region`, to where `reference` lies; all else then stands still.

    By default at the largest extent of `reference` and its footprint, on the same floor, turned by `rotation`: without
    one, a shape as a whole keeps its axes, and a part is turned so that what surrounds it is below. A part stands on
    the floor of the scene with its surroundings; where the reference lies higher, the part alone is lifted. `place`
    overrides all of this. `InputError` if the region is empty.
    """
    part, left = (geometry, None) if region is None else split(geometry, region)
    lift = 0.0 if left is None else float(np.asarray(reference.points)[:, 2].min())
    if place is None:
        points = np.asarray(part.points, dtype=float)
        if left is not None or isinstance(geometry, GaussianSplats):
            points = together(points)
        if left is not None:
            rotation = UPRIGHT[_up(points, np.asarray(left.points, dtype=float))] if rotation is None else rotation
        place = _standing(points, rotation, np.asarray(reference.points, dtype=float), lift)
    fitted = place.shape(part)
    if lift:
        fitted = replace(fitted, points=fitted.points + np.array([0.0, 0.0, lift], np.float32))
    return Fit(geometry, region, place, fitted, left, lift)


def _standing(points: Points, rotation: Rotations | None, target: Floats, lift: float) -> Similarity:
    """Of the extent of `target`, and where it stands less `lift`."""
    rotation = np.eye(3) if rotation is None else rotation
    turned = points @ rotation.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    extent = float((high - low).max())
    factor = float(np.ptp(target, axis=0).max()) / extent if extent > 0.0 else 1.0
    foot = np.array([*(0.5 * (low + high))[:2], low[2]])
    goal = np.array([*(0.5 * (target.min(axis=0) + target.max(axis=0)))[:2], target[:, 2].min() - lift])
    return Similarity(factor, rotation, goal - factor * foot)


def together(points: Floats) -> Floats:
    """Without those far off, as captures have them: beyond half as far again as 19 of 20 are from the middle."""
    away = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    return points[away <= 1.5 * np.quantile(away, 0.95)]


def _up(part: Points, left: Floats) -> str:
    """The axis along which a part rises from what surrounds it: away from the points within twice its reach."""
    centre = 0.5 * (part.min(axis=0) + part.max(axis=0))
    away = left - centre
    distance = np.linalg.norm(away, axis=1)
    near = (distance <= 2.0 * np.linalg.norm(part - centre, axis=1).max()) & (distance > 0.0)
    if not near.any():
        return "+z"
    mean = (away[near] / distance[near, None]).mean(axis=0)
    axis = int(np.abs(mean).argmax())
    return "+z" if np.abs(mean[axis]) < SURROUNDED else ("-" if mean[axis] > 0.0 else "+") + "xyz"[axis]
