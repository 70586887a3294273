"""The body of a figure: its mesh at rest and the basis of its deformations, in 16 bits."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int, Int16

from odeform.errors import InputError
from odeform.figure.table import quantised
from odeform.motion.reduced_motion import ReducedMotion
from odeform.motion.reduced_space import POSE, rotation_of
from odeform.types import Arrays, Floats, Frames, Mesh, Vector

__all__ = ["FigureBody", "figure_body"]


@dataclass(frozen=True, eq=False)
class FigureBody:
    """Points anchor + Rz(a) [ R(w) (x + sum_k c_k phi_k(x)) + p ] under coordinates y = [p, w, c]."""

    anchor: Vector
    azimuth: float
    """Radians."""
    rest: Float[np.ndarray, "points 3"]
    """x, in metres."""
    faces: Int[np.ndarray, "faces 3"]
    basis: Int16[np.ndarray, "modes entries"]
    """(K, 3 N) in `steps`."""
    steps: Float[np.ndarray, " modes"]
    """(K,) metres."""
    gyration_radius: float

    @cached_property
    def _modes(self) -> Floats:
        return (self.basis * self.steps[:, None]).astype(np.float32)

    @property
    def scale(self) -> Floats:
        """(6 + K,) by which coordinates become metres, RMS over the body."""
        scale = np.ones(POSE + len(self.steps))
        scale[3:POSE] = self.gyration_radius * np.sqrt(2.0 / 3.0)
        return scale

    def points(self, y: Float[np.ndarray, "times coordinates"]) -> Frames:
        """Computes (T, N, 3) metres under coordinates y (T, 6 + K)."""
        rotation, shift = rotation_of(y[:, :POSE], self.azimuth)
        local = self.rest + (y[:, POSE:].astype(np.float32) @ self._modes).reshape(len(y), -1, 3)
        moved = np.einsum("tij,tnj->tni", rotation.astype(np.float32), local)
        return moved + (shift + self.anchor).astype(np.float32)[:, None]

    def arrays(self) -> Arrays:
        """What the page holds of it, by name."""
        kind = np.uint16 if len(self.rest) <= 1 << 16 else np.uint32
        floats = {"anchor": self.anchor, "rest": self.rest, "steps": self.steps}
        whole = {"faces": self.faces.astype(kind), "basis": self.basis}
        return {name: np.asarray(array, dtype=np.float32) for name, array in floats.items()} | whole


def figure_body(motion: ReducedMotion, sagging: Float[np.ndarray, "extra points 3"]) -> FigureBody:
    """The body of a motion, with fields `sagging` (E, N, 3) in metres as further modes: how its rest differs.

    Raises `InputError` for a geometry without faces.
    """
    geometry, evaluated = motion.geometry, motion.evaluated
    if not isinstance(geometry, Mesh) or not len(geometry.faces):
        raise InputError(f"a figure shows a mesh with faces, got {type(geometry).__name__}")
    modes = np.concatenate([evaluated.values, sagging.reshape(len(sagging), evaluated.values.shape[1])])
    basis, steps = quantised(modes)
    space = evaluated.space
    return FigureBody(
        space.anchor, evaluated.azimuth, evaluated.rest, geometry.faces, basis, steps, space.gyration_radius
    )
