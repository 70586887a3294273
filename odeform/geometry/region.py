"""Regions of space that choose a part of a shape: a sphere or a box."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool

from odeform.errors import InputError
from odeform.geometry.rigid import is_rotation
from odeform.geometry.similarity import Similarity
from odeform.types import Points, Rotations, Vector

__all__ = ["Box", "Mask", "Region", "Sphere", "read_region", "region_from_json", "region_to_json"]

SHAPES = {"centre": (3,), "radius": (), "size": (3,), "rotation": (3, 3)}

Mask = Bool[np.ndarray, " points"]


@dataclass(frozen=True, eq=False)
class Sphere:
    """`centre` (3,) and `radius`, in the units of the shape."""

    centre: Vector
    radius: float

    def contains(self, points: Points) -> Mask:
        """(N,) which points lie in it or on it."""
        return np.asarray(np.linalg.norm(np.asarray(points, dtype=float) - self.centre, axis=1) <= self.radius)

    def transformed(self, by: Similarity) -> "Sphere":
        return Sphere(by.points(self.centre), by.factor * self.radius)


@dataclass(frozen=True, eq=False)
class Box:
    """`centre` (3,) and `size` (3,), whole edges, along the columns of `rotation`, in the units of the shape."""

    centre: Vector
    size: Vector
    rotation: Rotations = field(default_factory=lambda: np.eye(3))

    def contains(self, points: Points) -> Mask:
        """(N,) which points lie in it or on it."""
        local = (np.asarray(points, dtype=float) - self.centre) @ self.rotation
        return np.asarray((np.abs(local) <= 0.5 * np.asarray(self.size)).all(axis=1))

    def transformed(self, by: Similarity) -> "Box":
        return Box(by.points(self.centre), by.factor * np.asarray(self.size), by.rotation @ self.rotation)


Region = Sphere | Box


def region_to_json(region: Region) -> dict[str, Any]:
    """Plain values, which `region_from_json` takes."""
    if isinstance(region, Sphere):
        return {"sphere": {"centre": np.asarray(region.centre).tolist(), "radius": float(region.radius)}}
    parts = {"centre": region.centre, "size": region.size, "rotation": region.rotation}
    return {"box": {name: np.asarray(value).tolist() for name, value in parts.items()}}


def region_from_json(raw: Any) -> Region:
    """`InputError` for what is no region."""
    try:
        ((kind, values),) = raw.items()
        numbers = {name: np.asarray(value, dtype=float) for name, value in values.items()}
        for name, value in numbers.items():
            if value.shape != SHAPES[name] or not np.isfinite(value).all():
                raise ValueError(f"{name}: expected finite numbers {SHAPES[name]}")
        if "rotation" in numbers and not is_rotation(numbers["rotation"]):
            raise ValueError("rotation: expected one")
        if kind == "sphere":
            region: Region = Sphere(numbers["centre"], float(numbers["radius"]))
        elif kind == "box":
            region = Box(numbers["centre"], numbers["size"], numbers["rotation"])
        else:
            raise ValueError(f"got {kind!r}")
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"region: expected a sphere or a box in JSON: {error}") from None
    return region


def read_region(path: Path) -> Region:
    """The region that a JSON file holds. `InputError` if it holds none."""
    try:
        return region_from_json(json.loads(path.read_text()))
    except (InputError, ValueError) as error:
        raise InputError(f"{path}: {error}") from None
