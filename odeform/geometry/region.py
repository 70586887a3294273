"""Regions of space that select a part of a shape: a sphere or a box."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool

from odeform.errors import InputError
from odeform.geometry.rigid import is_rotation
from odeform.geometry.similarity import Similarity
from odeform.io import parse_json
from odeform.types import Points, Rotations, Vector

__all__ = ["Box", "Mask", "Region", "Sphere", "read_region", "region_from_json", "region_to_json"]

DIMENSIONS = {"centre": (3,), "radius": (), "size": (3,), "rotation": (3, 3)}

Mask = Bool[np.ndarray, " points"]
"""(N,) whether each point is selected."""


@dataclass(frozen=True, eq=False)
class Sphere:
    """A ball of `radius` about `centre` (3,), in the units of the shape."""

    centre: Vector
    radius: float

    def contains(self, points: Points) -> Mask:
        """(N,) whether each of `points` (N, 3) is inside or on the boundary."""
        return np.asarray(np.linalg.norm(np.asarray(points, dtype=float) - self.centre, axis=1) <= self.radius)

    def transformed(self, by: Similarity) -> "Sphere":
        """The region that contains the points moved by a similarity."""
        return Sphere(by.points(self.centre), by.factor * self.radius)


@dataclass(frozen=True, eq=False)
class Box:
    """A box about `centre` (3,), edges `size` (3,) along the columns of `rotation` (3, 3), in units of the shape."""

    centre: Vector
    size: Vector
    rotation: Rotations = field(default_factory=lambda: np.eye(3))

    def contains(self, points: Points) -> Mask:
        """(N,) whether each of `points` (N, 3) is inside or on the boundary."""
        local = (np.asarray(points, dtype=float) - self.centre) @ self.rotation
        return np.asarray((np.abs(local) <= 0.5 * np.asarray(self.size)).all(axis=1))

    def transformed(self, by: Similarity) -> "Box":
        """The region that contains the points moved by a similarity."""
        return Box(by.points(self.centre), by.factor * np.asarray(self.size), by.rotation @ self.rotation)


Region = Sphere | Box


def region_to_json(region: Region) -> dict[str, Any]:
    """Plain values for JSON; `region_from_json` is the inverse."""
    if isinstance(region, Sphere):
        return {"sphere": {"centre": np.asarray(region.centre).tolist(), "radius": float(region.radius)}}
    parts = {"centre": region.centre, "size": region.size, "rotation": region.rotation}
    return {"box": {name: np.asarray(value).tolist() for name, value in parts.items()}}


def region_from_json(raw: Any) -> Region:
    """Inverts `region_to_json`. Raises `InputError` for anything else."""
    try:
        ((kind, values),) = raw.items()
        numbers = {name: np.asarray(value, dtype=float) for name, value in values.items()}
        for name, value in numbers.items():
            if value.shape != DIMENSIONS[name] or not np.isfinite(value).all():
                raise ValueError(f"{name}: expected finite numbers {DIMENSIONS[name]}")
        if "rotation" in numbers and not is_rotation(numbers["rotation"]):
            raise ValueError("rotation: expected a rotation matrix")
        if kind == "sphere":
            region: Region = Sphere(numbers["centre"], float(numbers["radius"]))
        elif kind == "box":
            region = Box(numbers["centre"], numbers["size"], numbers["rotation"])
        else:
            raise ValueError(f"unknown kind {kind!r}")
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(f"region: expected a sphere or a box in JSON: {error}") from None
    return region


def read_region(path: Path) -> Region:
    """The region in a JSON file. Raises `InputError` if there is none."""
    try:
        return region_from_json(parse_json(path.read_bytes(), "region"))
    except (InputError, ValueError) as error:
        raise InputError(f"{path}: {error}") from None
