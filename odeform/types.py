"""Value types shared by all layers. Lengths are metres, times seconds, masses kilograms."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8
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
    "Offset",
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

# Shapes; dimensions of one name agree within a call. Checked at run time in tests only.
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
Offset = tuple[float, float, float]

SH0 = 0.28209479177387814  # zeroth real spherical harmonic, 1 / (2 sqrt(pi))


@dataclass(frozen=True, eq=False)
class PointCloud:
    """A shape given by points alone.

    Attributes:
        points: (N, 3) positions in metres.
        colors: (N, 3) red, green and blue in sRGB, 0 to 255; None for plain points.
        notes: What was dropped or changed when a file was read.
        up: The axis that points up, as "+y", where a file says so; empty otherwise.
        offset: Where the origin of `points` is in the coordinates of the file.

    Examples:
        >>> import numpy as np
        >>> import odeform
        >>> cloud = odeform.PointCloud(np.zeros((5, 3), np.float32))
        >>> odeform.load("kick").solve(cloud).vertices(0.1).shape
        (5, 3)
    """

    points: Points
    colors: UInt8[np.ndarray, "points 3"] | None = None
    notes: tuple[str, ...] = ()
    up: str = ""
    offset: Offset = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh.

    Attributes:
        points: (N, 3) vertices in metres.
        faces: (F, 3) indices of vertices, counter-clockwise when seen from outside.
        colors: (F, 3, 3) red, green and blue in sRGB at the corners of each face, 0 to 255; None for a plain mesh.
        notes: What was dropped or changed when a file was read.
        up: The axis that points up, as "+y", where a file says so; empty otherwise.
        offset: Where the origin of `points` is in the coordinates of the file.

    Examples:
        >>> import numpy as np
        >>> import odeform
        >>> corners = 0.1 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
        >>> faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)
        >>> odeform.load("kick").solve(odeform.Mesh(corners, faces)).vertices(0.1).shape
        (4, 3)
    """

    points: Points
    faces: Faces
    colors: UInt8[np.ndarray, "faces 3 3"] | None = None
    notes: tuple[str, ...] = ()
    up: str = ""
    offset: Offset = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class GaussianSplats:
    """3D Gaussian splats (Kerbl et al. 2023).

    Attributes:
        points: (N, 3) centres in metres.
        covariances: (N, 3, 3) in square metres.
        harmonics: (N, H, 3) coefficients of red, green and blue for H = 1, 4, 9 or 16 spherical harmonics, the constant
            first; `odeform.geometry.harmonics` documents their order and signs.
        opacities: (N,) in [0, 1].
        notes: What was dropped when a file was read: unsupported properties, or splats that are not finite.
        up: The axis that points up, as "+y", where a file says so; empty otherwise.
        offset: Where the origin of `points` is in the coordinates of the file.

    Examples:
        >>> import numpy as np
        >>> import odeform
        >>> covariances = np.tile(1e-4 * np.eye(3), (2, 1, 1))
        >>> splats = odeform.GaussianSplats(np.zeros((2, 3)), covariances, np.zeros((2, 1, 3)), np.ones(2))
        >>> splats.colors[0]
        array([0.5, 0.5, 0.5])
        >>> odeform.load("kick").solve(splats).covariances(0.1).shape
        (2, 3, 3)
    """

    points: Points
    covariances: Float[np.ndarray, "points 3 3"]
    harmonics: Harmonics
    opacities: Perpoint
    notes: tuple[str, ...] = ()
    up: str = ""
    offset: Offset = (0.0, 0.0, 0.0)

    @cached_property
    def colors(self) -> Points:
        """(N, 3) red, green and blue in [0, 1]: the constant part, averaged over all directions."""
        return np.clip(0.5 + SH0 * self.harmonics[:, 0], 0.0, 1.0)


Geometry = Mesh | PointCloud | GaussianSplats


@dataclass(frozen=True, eq=False)
class MotionSequence:
    """One recorded or simulated motion.

    Attributes:
        times: (T,) seconds, evenly spaced from 0.
        vertices: (T, N, 3) positions in metres; frame 0 is the body at rest.
        faces: (F, 3) indices of vertices.
        weights: (N,) mass fraction at each vertex; they sum to 1.
        parameters: By name, in the units of the data set's schema; "object" is a string.
        name: That of the sequence in its data set.

    Examples:
        >>> import odeform
        >>> sequence = next(odeform.open_dataset("kick").sequences("train"))
        >>> sequence.vertices.shape, sequence.times[-1].item()
        ((121, 402, 3), 1.0)
        >>> sequence.until(0.5, every=2).vertices.shape
        (31, 402, 3)
    """

    times: Times
    vertices: Frames
    faces: Faces
    weights: Perpoint
    parameters: dict[str, Any] = field(default_factory=dict)
    name: str = ""

    @property
    def rest(self) -> Mesh:
        """The body at rest: frame 0, N vertices in metres."""
        return Mesh(self.vertices[0], self.faces)

    def frames(self, stop: float, rate: float) -> "MotionSequence":
        """The frames at `rate` Hz up to `stop` seconds. The sequence's own rate is a multiple of `rate`."""
        step = float(self.times[1] - self.times[0])
        return self.until(stop, max(round(1.0 / (rate * step)), 1))

    def until(self, stop: float, every: int = 1) -> "MotionSequence":
        """Every n-th frame up to `stop` seconds. A sequence that ends earlier, at rest, keeps its last frame."""
        step = float(self.times[1] - self.times[0])
        times = np.arange(round(stop / step) + 1)[::every] * step
        kept = np.minimum(np.arange(len(times)) * every, len(self.times) - 1)
        return replace(self, times=times, vertices=self.vertices[kept])
