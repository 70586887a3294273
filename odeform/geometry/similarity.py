"""Similarity transforms: uniform scale, rotation and translation."""

from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from odeform.errors import InputError
from odeform.geometry.harmonics import rotated_harmonics
from odeform.geometry.rigid import is_rotation, rotation_from_vector
from odeform.types import Floats, GaussianSplats, Geometry, Rotations, Vector, Vectors

__all__ = ["UPRIGHT", "Similarity"]

Shape = TypeVar("Shape", bound=Geometry)

UPRIGHT: dict[str, Rotations] = {
    name: np.round(rotation_from_vector(0.5 * np.pi * np.array(quarters)))
    for name, quarters in {
        "+z": (0.0, 0.0, 0.0),
        "-z": (2.0, 0.0, 0.0),
        "+y": (1.0, 0.0, 0.0),
        "-y": (-1.0, 0.0, 0.0),
        "+x": (0.0, -1.0, 0.0),
        "-x": (0.0, 1.0, 0.0),
    }.items()
}
"""Axis of a file that points up -> the rotation that makes it +z."""


def _eye() -> Rotations:
    return np.eye(3)


@dataclass(frozen=True, eq=False)
class Similarity:
    """x -> factor * rotation x + shift, with the shift in the units of the result. The identity by default."""

    factor: float = 1.0
    rotation: Rotations = field(default_factory=_eye)
    shift: Vector = field(default_factory=lambda: np.zeros(3))

    def to_json(self) -> dict[str, Any]:
        """Plain values for JSON; `Similarity.from_json` is the inverse."""
        return {"factor": float(self.factor), "rotation": self.rotation.tolist(), "shift": self.shift.tolist()}

    @classmethod
    def from_json(cls, raw: Any) -> "Similarity":
        """Inverts `to_json`. Raises `InputError` for anything else."""
        try:
            factor = float(raw["factor"])
            rotation, shift = np.array(raw["rotation"], dtype=float), np.array(raw["shift"], dtype=float)
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise InputError(f"similarity: expected factor, rotation and shift: {error!r}") from None
        sound = is_rotation(rotation) and 0.0 < factor < np.inf and shift.shape == (3,) and np.isfinite(shift).all()
        if not sound:
            raise InputError("similarity: expected a factor above 0, a rotation matrix (3, 3) and a shift (3,)")
        return cls(factor, rotation, shift)

    @property
    def inverse(self) -> "Similarity":
        """The similarity that undoes this one."""
        back = self.rotation.T
        return Similarity(1.0 / self.factor, back, -(back @ self.shift) / self.factor)

    def __matmul__(self, first: "Similarity") -> "Similarity":
        """The composition that applies `first` before this one."""
        return Similarity(self.factor * first.factor, self.rotation @ first.rotation, self.points(first.shift))

    def points(self, points: Vectors) -> Vectors:
        """Transform (..., 3) points, in double precision."""
        return self.factor * (np.asarray(points, dtype=float) @ self.rotation.T) + self.shift

    def covariances(self, covariances: Floats) -> Floats:
        """Transform (..., 3, 3) covariances."""
        return self.factor**2 * (self.rotation @ covariances @ self.rotation.T)

    def shape(self, shape: Shape) -> Shape:
        """Transform a geometry with all its attributes; its points become float32. What its file says of the axes and
        the origin does not hold any more, and is left out."""
        points = self.points(shape.points).astype(np.float32)
        moved = replace(shape, points=points, up="", offset=(0.0, 0.0, 0.0))
        if not isinstance(moved, GaussianSplats):
            return moved
        turned = moved.harmonics
        if not np.array_equal(self.rotation, np.eye(3)):
            turned = rotated_harmonics(turned, self.rotation)
        return replace(moved, covariances=self.covariances(moved.covariances), harmonics=turned)
