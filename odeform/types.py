"""Value types shared by all layers. Lengths are metres, times seconds, masses kilograms."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Arrays", "Floats", "GaussianSplats", "Geometry", "Ints", "Mesh", "PointCloud", "Sequence"]

Floats = NDArray[np.floating]
Ints = NDArray[np.integer]
Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class PointCloud:
    """`points` (N, 3) metres."""

    points: Floats


@dataclass(frozen=True, eq=False)
class Mesh:
    """`points` (N, 3) metres, `faces` (F, 3) indices, counter-clockwise from outside."""

    points: Floats
    faces: Ints


@dataclass(frozen=True, eq=False)
class GaussianSplats:
    """`points` (N, 3) centres in m, `covariances` (N, 3, 3) m^2, `colors` (N, 3) and `opacities` (N,) in [0, 1]."""

    points: Floats
    covariances: Floats
    colors: Floats
    opacities: Floats


Geometry = Mesh | PointCloud | GaussianSplats


@dataclass(frozen=True, eq=False)
class Sequence:
    """One observed or simulated motion.

    `times` (T,) s; `vertices` (T, N, 3) m, frame 0 is the rest state; `faces` (F, 3); `weights` (N,) share of the
    mass at each vertex, summing to 1; `parameters` in the units of the schema.
    """

    times: Floats
    vertices: Floats
    faces: Ints
    weights: Floats
    parameters: dict[str, float] = field(default_factory=dict)
    name: str = ""

    @property
    def rest(self) -> Mesh:
        return Mesh(self.vertices[0], self.faces)
