"""An observed motion: points of the body at rest, and their positions at some times."""

import zlib
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.schema import Schema
from odeform.types import Floats, Ints, MotionSequence, Points, Times

__all__ = ["ROUNDING_MM", "Observation", "View", "observe"]

ROUNDING_MM = 0.02  # of the bundled data; more than the truncation error of the modes
REST_SPEED = 0.01  # m/s of the fastest vertex; what is slower at its last frame rests
MOST_POINTS, MOST_FRAMES = 64, 160


@dataclass(frozen=True, eq=False)
class Observation:
    """Positions of points of a body over time, for `identify`.

    Attributes:
        rest: (N, 3) metres: points anywhere on the body, as it rests in the scene.
        times: (T,) seconds from the start of the motion.
        positions: (T, N, 3) metres: the same points at these times.
        azimuth: The scene's azimuth in radians, which has to be known; 0 for a scene without one.
        noise_mm: Standard deviation of each coordinate in millimetres.

    Raises:
        InputError: Shapes that do not agree, values that are not finite, negative times, or noise that is not positive.

    Examples:
        >>> import odeform
        >>> truth = next(odeform.open_dataset("mass-elastic").sequences("val"))
        >>> observation = odeform.Observation(
        ...     rest=truth.vertices[0, ::40], times=truth.times[24::24], positions=truth.vertices[24::24, ::40]
        ... )
        >>> observation.rest.shape
        (11, 3)
    """

    rest: Points
    times: Times
    positions: Float[np.ndarray, "frames points 3"]
    azimuth: float = 0.0
    noise_mm: float = ROUNDING_MM

    def __post_init__(self) -> None:
        expected = (len(self.times), *self.rest.shape)
        if self.positions.shape != expected:
            raise InputError(f"observation: expected positions of shape {expected}, got {self.positions.shape}")
        if not self.positions.size:
            raise InputError("observation: expected at least one point and one time")
        if not all(np.isfinite(x).all() for x in (self.rest, self.times, self.positions)):
            raise InputError("observation: expected finite points and times")
        if self.times.min() < 0.0 or not self.noise_mm > 0.0:
            raise InputError("observation: expected times of at least 0 and positive noise")

    def subsampled(self, points: int = MOST_POINTS, frames: int = MOST_FRAMES) -> "Observation":
        """Keeps at most `points` points and `frames` frames, evenly chosen: more take time and add little."""
        kept, at = _evenly(len(self.rest), points), _evenly(len(self.times), frames)
        positions = self.positions[at][:, kept]
        return Observation(self.rest[kept], self.times[at], positions, self.azimuth, self.noise_mm)


def _evenly(count: int, most: int) -> Ints:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


@dataclass(frozen=True)
class View:
    """The part of a recorded motion that is observed."""

    points: int | None = None
    """Number of random points on the surface; None: the vertices."""
    frames: int | None = None
    """Number of random frames of the trained window, without the first; None: all."""
    noise_mm: float = 0.0
    """Standard deviation of the noise added to each coordinate."""
    seed: int = 0

    def __post_init__(self) -> None:
        if any(count is not None and count < 1 for count in (self.points, self.frames)) or self.seed < 0:
            raise InputError("view: expected at least one point and one frame, and a seed of at least 0")
        if not 0.0 <= self.noise_mm < float("inf"):
            raise InputError(f"view: expected noise of at least 0 mm, got {self.noise_mm}")


def observe(recorded: MotionSequence, schema: Schema, view: View) -> Observation:
    """Observe a sequence on frames of the window. The view's seed and the sequence's name fix the random part.

    What ends at rest stays there until the window ends; what ends while it moves is observed until then.
    """
    rng = np.random.default_rng([view.seed, zlib.crc32(recorded.name.encode())])
    sequence = recorded.until(schema.window.stop)
    frames = schema.window.times[1:]
    if _moves_at_end(recorded):
        frames = frames[frames <= recorded.times[-1] + 1e-9]
    if view.frames is not None:
        frames = np.sort(rng.choice(frames, min(view.frames, len(frames)), replace=False))
    at = np.abs(sequence.times[:, None] - frames).argmin(axis=0)
    observed = sequence.vertices[np.concatenate([[0], at])].astype(float)
    if view.points is not None:
        observed = _on_surface(sequence, observed, view.points, rng)
    rest, positions = observed[0], observed[1:]
    positions = positions + 1e-3 * view.noise_mm * rng.normal(size=positions.shape)
    noise = float(np.hypot(view.noise_mm, ROUNDING_MM))
    return Observation(rest, sequence.times[at], positions, schema.azimuth(sequence.parameters), noise)


def _moves_at_end(recorded: MotionSequence) -> bool:
    step = float(recorded.times[-1] - recorded.times[-2])
    return float(np.abs(np.diff(recorded.vertices[-2:], axis=0)).max()) > REST_SPEED * step


def _on_surface(sequence: MotionSequence, frames: Floats, count: int, rng: np.random.Generator) -> Floats:
    """(T, N, 3) m -> (T, count, 3) m: random points, uniform over the surface, that move with their faces."""
    corners = frames[0][sequence.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    faces = sequence.faces[rng.choice(len(areas), count, p=areas / areas.sum())]
    return np.einsum("nc,tnci->tni", rng.dirichlet(np.ones(3), count), frames[:, faces])
