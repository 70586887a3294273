"""Value types shared by all layers. Lengths are metres, times seconds, masses kilograms."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

__all__ = [
    "SH0",
    "Arrays",
    "Basis",
    "Faces",
    "Floats",
    "Frames",
    "GaussianSplats",
    "Geometry",
    "Harmonics",
    "Ints",
    "Matrices",
    "Mesh",
    "MotionSequence",
    "Perpoint",
    "PointCloud",
    "Points",
    "Pose",
    "Rotations",
    "Times",
    "Vector",
    "Vectors",
]

Floats = NDArray[np.floating]
Ints = NDArray[np.integer]
Bools = NDArray[np.bool_]
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
Harmonics = Float[np.ndarray, "points harmonics 3"]

SH0 = 0.28209479177387814  # zeroth real spherical harmonic, 1 / (2 sqrt(pi))


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
    """`points` (N, 3) centres in m, `covariances` (N, 3, 3) m^2, `opacities` (N,) in [0, 1].

    `harmonics` (N, H, 3) are the coefficients of red, green and blue for H = 1, 4, 9 or 16 spherical harmonics, the
    constant first (`odeform.geometry.harmonics` has their order and signs). `notes` say what a file had beyond that,
    or had broken.
    """

    points: Points
    covariances: Float[np.ndarray, "points 3 3"]
    harmonics: Harmonics
    opacities: Perpoint
    notes: tuple[str, ...] = ()

    @cached_property
    def colors(self) -> Points:
        """(N, 3) in [0, 1]: the constant part, as if seen from all sides at once."""
        return np.clip(0.5 + SH0 * self.harmonics[:, 0], 0.0, 1.0)


Geometry = Mesh | PointCloud | GaussianSplats


@dataclass(frozen=True, eq=False)
class MotionSequence:
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

    def frames(self, stop: float, rate: float) -> "MotionSequence":
        """Those of a rate in Hz, which the sequence may be a multiple of, up to `stop` seconds."""
        step = float(self.times[1] - self.times[0])
        return self.until(stop, max(round(1.0 / (rate * step)), 1))

    def until(self, stop: float, every: int = 1) -> "MotionSequence":
        """Every k-th frame up to `stop` seconds. A sequence that ended before, at rest, stays as it was."""
        step = float(self.times[1] - self.times[0])
        times = np.arange(round(stop / step) + 1)[::every] * step
        kept = np.minimum(np.arange(len(times)) * every, len(self.times) - 1)
        return replace(self, times=times, vertices=self.vertices[kept])
