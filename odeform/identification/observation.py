"""What was seen of a motion: points of the body at rest, and where they were at some moments."""

import zlib
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.schema import Schema
from odeform.types import Floats, Ints, MotionSequence, Points, Times

__all__ = ["ROUNDING_MM", "Observation", "View", "observe"]

ROUNDING_MM = 0.02  # of the bundled data, and more than what the modes of the models leave out
MOST_POINTS, MOST_FRAMES = 64, 160


@dataclass(frozen=True, eq=False)
class Observation:
    """`rest` (N, 3) are points anywhere on the body as it rests in the scene, `positions` (T, N, 3) where they were
    at `times` (T,) seconds after that; metres. `heading` in radians is the scene's azimuth, which is known. `noise_mm`
    is the standard deviation of each coordinate."""

    rest: Points
    times: Times
    positions: Float[np.ndarray, "frames points 3"]
    heading: float = 0.0
    noise_mm: float = ROUNDING_MM

    def __post_init__(self) -> None:
        wanted = (len(self.times), *self.rest.shape)
        if self.positions.shape != wanted:
            raise InputError(f"observation: expected positions of shape {wanted}, got {self.positions.shape}")
        if not self.positions.size:
            raise InputError("observation: expected at least one point at one moment")
        if not all(np.isfinite(x).all() for x in (self.rest, self.times, self.positions)):
            raise InputError("observation: expected finite points and times")
        if self.times.min() < 0.0 or not self.noise_mm > 0.0:
            raise InputError("observation: expected times from 0 on and positive noise")

    def thinned(self, points: int = MOST_POINTS, frames: int = MOST_FRAMES) -> "Observation":
        """At most so many points and frames, evenly chosen: more cost time and tell little."""
        kept, at = _evenly(len(self.rest), points), _evenly(len(self.times), frames)
        positions = self.positions[at][:, kept]
        return Observation(self.rest[kept], self.times[at], positions, self.heading, self.noise_mm)


def _evenly(count: int, most: int) -> Ints:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


@dataclass(frozen=True)
class View:
    """How much of a recorded motion is seen."""

    points: int | None = None
    """So many, drawn on the surface; None: the vertices."""
    frames: int | None = None
    """So many of the trained ones after the first, drawn at random; None: all."""
    noise_mm: float = 0.0
    """Standard deviation of what is added to each coordinate."""
    seed: int = 0

    def __post_init__(self) -> None:
        if any(count is not None and count < 1 for count in (self.points, self.frames)) or self.seed < 0:
            raise InputError("view: expected at least one point and one frame, and a seed from 0 on")
        if not 0.0 <= self.noise_mm < float("inf"):
            raise InputError(f"view: expected noise of at least 0 mm, got {self.noise_mm}")


def observe(recorded: MotionSequence, schema: Schema, view: View) -> Observation:
    """What `view` sees of a sequence on the window's frames. The seed and the sequence's name decide what is drawn."""
    rng = np.random.default_rng([view.seed, zlib.crc32(recorded.name.encode())])
    sequence = recorded.until(schema.window.stop)
    frames = schema.window.times[1:]
    if view.frames is not None:
        frames = np.sort(rng.choice(frames, min(view.frames, len(frames)), replace=False))
    at = np.abs(sequence.times[:, None] - frames).argmin(axis=0)
    seen = sequence.vertices[np.concatenate([[0], at])].astype(float)
    if view.points is not None:
        seen = _on_surface(sequence, seen, view.points, rng)
    rest, positions = seen[0], seen[1:]
    positions = positions + 1e-3 * view.noise_mm * rng.normal(size=positions.shape)
    noise = float(np.hypot(view.noise_mm, ROUNDING_MM))
    return Observation(rest, sequence.times[at], positions, schema.azimuth(sequence.parameters), noise)


def _on_surface(sequence: MotionSequence, frames: Floats, count: int, rng: np.random.Generator) -> Floats:
    """(T, N, 3) frames -> (T, count, 3), points drawn evenly over the faces, with which they move."""
    corners = frames[0][sequence.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    faces = sequence.faces[rng.choice(len(areas), count, p=areas / areas.sum())]
    return np.einsum("nc,tnci->tni", rng.dirichlet(np.ones(3), count), frames[:, faces])
