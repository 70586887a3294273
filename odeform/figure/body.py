"""The body of a figure: its mesh or the nodes of its splats at rest, and the basis of its deformations, in 16 bits."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int, Int16

from odeform.errors import InputError
from odeform.figure.splats import FigureSplats, figure_splats
from odeform.figure.table import quantised
from odeform.geometry.split_colors import SplitColors, split_colors
from odeform.motion.reduced_motion import ReducedMotion
from odeform.motion.reduced_space import POSE, rotation_of
from odeform.types import Arrays, Floats, Frames, GaussianSplats, Ints, Mesh, Vector

__all__ = ["FigureBody", "figure_body"]


@dataclass(frozen=True, eq=False)
class FigureBody:
    """Points anchor + Rz(a) [ R(w) (x + sum_k c_k phi_k(x)) + p ] under coordinates y = [p, w, c].

    These are the vertices of a mesh, or nodes that carry `splats`.
    """

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
    colors: SplitColors | None = None
    """Of a mesh that has colours of its own."""
    splats: FigureSplats | None = None

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
        """Computes (T, N, 3) metres under coordinates y (T, 6 + K): vertices, or centres of splats."""
        rotation, shift = rotation_of(y[:, :POSE], self.azimuth)
        moved = (y[:, POSE:].astype(np.float32) @ self._modes).reshape(len(y), -1, 3)
        local = self.rest + moved if self.splats is None else self.splats.local(moved)
        moved = np.einsum("tij,tnj->tni", rotation.astype(np.float32), local)
        return moved + (shift + self.anchor).astype(np.float32)[:, None]

    def within(self, most_bytes: int) -> "FigureBody":
        """Keeps so much of the splats that they take at most so many bytes; a mesh stays as it is."""
        return self if self.splats is None else replace(self, splats=self.splats.within(most_bytes))

    def sampled(self) -> "tuple[FigureBody, Ints | None]":
        """The body with the points of which errors are measured, and which of the geometry's they are; None for all."""
        if self.splats is None:
            return self, None
        some = self.splats.sampled()
        return replace(self, splats=some), some.kept

    def arrays(self) -> Arrays:
        """What the page holds of it, by name."""
        floats = {"anchor": self.anchor, "rest": self.rest, "steps": self.steps}
        found = {name: np.asarray(array, dtype=np.float32) for name, array in floats.items()} | {"basis": self.basis}
        if self.splats is not None:
            return found | self.splats.arrays()
        if self.colors is None:
            return found | {"faces": _narrow(self.faces, len(self.rest))}
        split, count = self.colors, len(self.colors.vertices)
        corners = _narrow(split.vertices, len(self.rest))
        return found | {"faces": _narrow(split.faces, count), "corners": corners, "colors": split.colors}


def _narrow(indices: Ints, count: int) -> Ints:
    return indices.astype(np.uint16 if count <= 1 << 16 else np.uint32)


def figure_body(
    motion: ReducedMotion, sagging: Float[np.ndarray, "extra points 3"], still: GaussianSplats | None = None
) -> FigureBody:
    """The body of a motion, with fields `sagging` (E, N, 3) in metres as further modes: how its rest differs.

    With splats, `still` are those of the scene that do not move. Raises `InputError` for a geometry that is neither
    splats nor a mesh with faces.
    """
    geometry, evaluated = motion.geometry, motion.evaluated
    space, modes = evaluated.space, evaluated.values
    if isinstance(geometry, GaussianSplats):
        splats = figure_splats(motion, still)
        nodes = splats.binding.nodes
        values, rest = modes.reshape(len(modes), -1, 3)[:, nodes].reshape(len(modes), -1), evaluated.rest[nodes]
        faces, colors = np.zeros((0, 3), dtype=np.int32), None
    elif isinstance(geometry, Mesh) and len(geometry.faces):
        values = np.concatenate([modes, sagging.reshape(len(sagging), modes.shape[1])])
        rest, faces, splats, colors = evaluated.rest, geometry.faces, None, split_colors(geometry)
    else:
        raise InputError(f"a figure shows splats, or a mesh with faces, got {type(geometry).__name__}")
    basis, steps = quantised(values)
    return FigureBody(space.anchor, evaluated.azimuth, rest, faces, basis, steps, space.gyration_radius, colors, splats)
