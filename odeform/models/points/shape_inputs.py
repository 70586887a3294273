"""What one network for all shapes is told of a body and a push, without units, in axes that are turned to the force.

A push of a body that stands turned about the vertical axis is the same push, turned. So the horizontal part of the
force is always along x here; mechanics has that symmetry, and no network needs to learn it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.geometry.rigid import rotation_z
from odeform.geometry.shape import surface_weights
from odeform.motion.point_motion import PointFrame
from odeform.schema import BEYOND, soft_clip
from odeform.surroundings import GRAVITY
from odeform.types import Floats, Geometry, Perpoint, Points, Rotations

__all__ = ["Body", "Ranges", "body_of", "descriptions", "turns_to_force"]

WEAKEST = 1e-6
"""N; a weaker force has no direction."""


@dataclass(frozen=True, eq=False)
class Body:
    """A shape at rest, with the mass and the stiffness that no shape tells."""

    points: Points
    """(N, 3) m, as it rests in the scene."""
    areas: Perpoint
    """(N,) fractions of the surface."""
    mass: float
    """kg."""
    young: float
    """Pa, Young's modulus."""
    centre: Float[np.ndarray, " 3"]
    """m: the centre of the surface."""
    gyration_radius: float
    """m: of the surface, about its centre."""

    def frame(self, units: "Ranges") -> PointFrame:
        """Returns the units of its motions; metres."""
        x, y, z = (float(value) for value in self.centre)
        size, spread = self.gyration_radius, units.scale * self.gyration_radius
        finer = units.part_scale * size
        return PointFrame((x, y, z), size, units.reach * size, units.largest * size, spread, finer)


def body_of(geometry: Geometry, mass: float, young: float) -> Body:
    """A shape as the network sees it; kg and Pa. `InputError` for one without extent."""
    points, areas = np.asarray(geometry.points, dtype=float), surface_weights(geometry)
    centre = areas @ points
    gyration_radius = float(np.sqrt(areas @ ((points - centre) ** 2).sum(axis=1)))
    if not gyration_radius > 0.0:
        raise InputError("geometry: expected points at several places")
    return Body(points, areas, mass, young, centre, gyration_radius)


@dataclass(frozen=True)
class Ranges:
    """Ranges of the training data: what inputs are normalised by, and units of displacements in radii of gyration."""

    low: tuple[float, ...]
    high: tuple[float, ...]
    """Smallest and largest of each number of `descriptions`."""
    scale: float
    """RMS displacement."""
    part_scale: float
    """RMS deformation."""
    largest: float
    """Largest displacement."""
    reach: float
    """Largest distance from the centre."""

    def bounded(self, described: Floats) -> Floats:
        """Maps descriptions (S, n) to [-1, 1], softly clipped beyond, so that inputs of networks are bounded."""
        low, high = np.array(self.low), np.array(self.high)
        return soft_clip(2.0 * (described - low) / (high - low) - 1.0, 1.0, BEYOND)

    def denormalised(self, bounded: Floats) -> Floats:
        """Inverts `bounded` where nothing was clipped: (S, n) in [-1, 1] -> (S, n)."""
        low, high = np.array(self.low), np.array(self.high)
        return low + (high - low) * (bounded + 1.0) / 2.0

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "Ranges":
        """The inverse of `dataclasses.asdict`; `KeyError`, `TypeError` or `ValueError` where something is missing."""
        values = dict(data)
        low, high = (tuple(float(value) for value in values.pop(name)) for name in ("low", "high"))
        sizes = {name: float(value) for name, value in values.items()}
        ordered = len(low) == len(high) and all(-np.inf < a < b < np.inf for a, b in zip(low, high, strict=True))
        if not ordered or not all(0.0 < size < np.inf for size in sizes.values()):
            raise ValueError(f"ranges: expected positive sizes, and lows below highs, got {dict(data)}")
        return cls(low, high, **sizes)


def turns_to_force(force: Float[np.ndarray, "cases 3"]) -> Rotations:
    """(S, 3, 3) rotations about the vertical axis that turn forces (S, 3) so that nothing of them is along y."""
    return np.stack([rotation_z(-float(np.arctan2(y, x))) for x, y, _ in force])


def descriptions(
    body: Body, contact: Float[np.ndarray, "cases 3"], force: Float[np.ndarray, "cases 3"]
) -> Float[np.ndarray, "cases _"]:
    """(S, 9) numbers for pushes at contacts (S, 3) in metres by forces (S, 3) in newton.

    The contact in radii of gyration about the centre, turned; the horizontal and the vertical part of the direction of
    the force; the logarithms of force by weight and of force by stiffness; the size; the height of the centre.
    """
    turned = np.einsum("sij,sj->si", turns_to_force(force), contact - body.centre) / body.gyration_radius
    size = np.maximum(np.linalg.norm(force, axis=1), WEAKEST)
    direction = np.stack([np.linalg.norm(force[:, :2], axis=1) / size, force[:, 2] / size], axis=1)
    relative = np.log(np.stack([size / (body.mass * GRAVITY), size / (body.young * body.gyration_radius**2)], axis=1))
    whole = np.array([np.log(body.gyration_radius), body.centre[2] / body.gyration_radius])
    return np.concatenate([turned, direction, relative, np.broadcast_to(whole, (len(force), 2))], axis=1)
