"""Value types shared by all layers. Lengths are metres, times seconds, masses kilograms."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

__all__ = [
    "Arrays",
    "Basis",
    "Faces",
    "Floats",
    "Frames",
    "GaussianSplats",
    "Geometry",
    "Ints",
    "Matrices",
    "Mesh",
    "Perpoint",
    "PointCloud",
    "Points",
    "Pose",
    "Rotations",
    "Sequence",
    "Times",
    "Vector",
    "Vectors",
]

Floats = NDArray[np.floating]
Ints = NDArray[np.integer]
Arrays = dict[str, NDArray[Any]]

# Shapes; sizes of one name agree within a call. Checked at run time in tests only.
Points = Float[np.ndarray, "points 3"]
Perpoint = Float[np.ndarray, "points"]
Faces = Int[np.ndarray, "faces 3"]
Frames = Float[np.ndarray, "times points 3"]
Times = Float[np.ndarray, "times"]
Vector = Float[np.ndarray, "3"]
Vectors = Float[np.ndarray, "*batch 3"]
Rotations = Float[np.ndarray, "*batch 3 3"]
Matrices = Float[np.ndarray, "points 3 3"]
Pose = Float[np.ndarray, "*batch 4 4"]
Basis = Float[np.ndarray, "points 3 modes"]


@dataclass(frozen=True, eq=False)
class PointCloud:
    """`points` (N, 3) metres."""

    points: Points


@dataclass(frozen=True, eq=False)
class Mesh:
    """`points` (N, 3) metres, `faces` (F, 3) indices, counter-clockwise from outside."""

    points: Points
    faces: Faces


@dataclass(frozen=True, eq=False)
class GaussianSplats:
    """`points` (N, 3) centres in m, `covariances` (N, 3, 3) m^2, `colors` (N, 3) and `opacities` (N,) in [0, 1]."""

    points: Points
    covariances: Float[np.ndarray, "points 3 3"]
    colors: Points
    opacities: Perpoint


Geometry = Mesh | PointCloud | GaussianSplats


@dataclass(frozen=True, eq=False)
class Sequence:
    """One observed or simulated motion.

    `times` (T,) s; `vertices` (T, N, 3) m, frame 0 is the rest state; `faces` (F, 3); `weights` (N,) share of the
    mass at each vertex, summing to 1; `parameters` in the units of the schema.
    """

    times: Times
    vertices: Frames
    faces: Faces
    weights: Perpoint
    parameters: dict[str, float] = field(default_factory=dict)
    name: str = ""

    @property
    def rest(self) -> Mesh:
        return Mesh(self.vertices[0], self.faces)

    def until(self, stop: float, every: int = 1) -> "Sequence":
        """Every k-th frame up to `stop` seconds. A sequence that ended before, at rest, stays as it was."""
        step = float(self.times[1] - self.times[0])
        times = np.arange(round(stop / step) + 1)[::every] * step
        kept = np.minimum(np.arange(len(times)) * every, len(self.times) - 1)
        return replace(self, times=times, vertices=self.vertices[kept])
