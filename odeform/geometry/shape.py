"""Surface weights of a shape, and the placement of a new shape where a model expects its body."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from odeform.geometry.parts import concatenated, split
from odeform.geometry.region import Region
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.geometry.upright import up_axis, up_of_rotation
from odeform.types import Floats, GaussianSplats, Geometry, Mesh, Perpoint, Points, Rotations

__all__ = ["FittedShape", "fit_to", "surface_weights", "without_outliers"]

EVEN = 0.2  # length of the mean unit vector below which the surroundings give no direction


def surface_weights(geometry: Geometry) -> Perpoint:
    """Computes the fraction (N,) of the surface at each point, summing to 1: a third of the adjacent faces; equal
    without faces."""
    count = len(geometry.points)
    if not isinstance(geometry, Mesh):
        return np.full(count, 1.0 / count)
    corners = np.asarray(geometry.points, dtype=float)[geometry.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    fractions = np.bincount(geometry.faces.ravel(), np.repeat(area, 3), minlength=count)
    total = fractions.sum()
    return fractions / total if total > 0.0 else np.full(count, 1.0 / count)


@dataclass(frozen=True, eq=False)
class FittedShape:
    """A shape, or the part of it within a region, placed where a body rests in the scene."""

    source: Geometry
    """The whole shape, as in its file."""
    region: Region | None
    """The part that moves, in the units of the file; None for all of it."""
    transform: Similarity
    """Maps the file's coordinates to the scene (metres)."""
    geometry: Geometry
    """The part that moves, at rest in the scene."""
    remainder: Geometry | None
    """The part that does not move, as in the file; None if all of it moves."""
    lift: float
    """Metres by which a body that is dropped starts above the part that does not move."""
    origin: str = ""
    """The file or the bundled shape that `source` was read from; empty if it cannot be read again."""
    upright: str = ""
    """Why an axis other than z was taken for up; empty if z was, or the user chose."""

    @cached_property
    def static(self) -> Geometry | None:
        """The part that does not move, in the scene."""
        return None if self.remainder is None else self.transform.shape(self.remainder)

    def to_file(self, moved: Geometry) -> Geometry:
        """The whole shape in the units and axes of the file, its moving part as `moved` has it in the scene."""
        back = self.transform.inverse.shape(moved)
        up = up_of_rotation(self.transform.rotation)
        return concatenated(replace(back, up=up, offset=self.source.offset), self.remainder)


def fit_to(
    geometry: Geometry,
    reference: Mesh,
    region: Region | None = None,
    rotation: Rotations | None = None,
    transform: Similarity | None = None,
) -> FittedShape:
    """Place a shape, or the part of it within `region`, where `reference` rests; the remainder then stays still.

    By default the shape is scaled to the largest extent of `reference` and stands on the same footprint and floor. A
    whole shape is turned so that the axis that points up (`odeform.geometry.upright.up_axis`) becomes z, and a part so
    that its surroundings are below it, unless `rotation` (3, 3) is given. A part stays on the floor of the scene with
    its surroundings; where `reference` is higher, the part alone is lifted. `transform` overrides all of this. Raises
    `InputError` if the region is empty.
    """
    part, remainder = (geometry, None) if region is None else split(geometry, region)
    lift = 0.0 if remainder is None else float(np.asarray(reference.points)[:, 2].min())
    reason = ""
    if transform is None:
        points = np.asarray(part.points, dtype=float)
        if remainder is not None or isinstance(geometry, GaussianSplats):
            points = without_outliers(points)
        if rotation is None and remainder is not None:
            rotation = UPRIGHT[_up(points, np.asarray(remainder.points, dtype=float)) or geometry.up or "+z"]
        elif rotation is None:
            up, reason = up_axis(geometry)
            rotation = UPRIGHT[up]
        transform = _standing(points, rotation, np.asarray(reference.points, dtype=float), lift)
    fitted = transform.shape(part)
    if lift:
        fitted = replace(fitted, points=fitted.points + np.array([0.0, 0.0, lift], np.float32))
    return FittedShape(geometry, region, transform, fitted, remainder, lift, upright=reason)


def _standing(points: Points, rotation: Rotations, target: Floats, lift: float) -> Similarity:
    """The similarity that gives `points` the extent and the footprint of `target`, `lift` metres lower."""
    turned = points @ rotation.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    extent = float((high - low).max())
    factor = float(np.ptp(target, axis=0).max()) / extent if extent > 0.0 else 1.0
    foot = np.array([*(0.5 * (low + high))[:2], low[2]])
    goal = np.array([*(0.5 * (target.min(axis=0) + target.max(axis=0)))[:2], target[:, 2].min() - lift])
    return Similarity(factor, rotation, goal - factor * foot)


def without_outliers(points: Floats) -> Floats:
    """(M, 3) without stray points, which captures have: beyond 1.5 times the 95 % quantile of the distance to the
    median."""
    away = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    return points[away <= 1.5 * np.quantile(away, 0.95)]


def _up(part: Points, remainder: Floats) -> str:
    """The signed axis along which a part rises from its surroundings: away from the points within twice its radius.
    Empty where they give no direction."""
    centre = 0.5 * (part.min(axis=0) + part.max(axis=0))
    away = remainder - centre
    distance = np.linalg.norm(away, axis=1)
    near = (distance <= 2.0 * np.linalg.norm(part - centre, axis=1).max()) & (distance > 0.0)
    if not near.any():
        return ""
    mean = (away[near] / distance[near, None]).mean(axis=0)
    axis = int(np.abs(mean).argmax())
    return "" if np.abs(mean[axis]) < EVEN else ("-" if mean[axis] > 0.0 else "+") + "xyz"[axis]
