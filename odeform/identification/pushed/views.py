"""Observes recorded or predicted motions of a body: some of its points with correspondence, or clouds of half of it."""

from dataclasses import dataclass

import numpy as np

from odeform.identification.pushed.evidence import Cloud, Known
from odeform.identification.pushed.state import Camera
from odeform.types import Faces, Floats, Frames, Ints, MotionSequence, Times

__all__ = ["CloudView", "cloud_of", "points_of", "window_of"]

ROUNDING_MM = 0.05  # of recorded vertices
MOST_POINTS, MOST_FRAMES = 64, 24


def window_of(recorded: MotionSequence, stop: float, rate: float) -> tuple[Times, Frames]:
    """The frames of a recorded motion at `rate` Hz until `stop` s, the first at rest: (T,) s and (T, S, 3) m."""
    wanted = np.arange(round(stop * rate) + 1) / rate
    at = np.unique(np.abs(recorded.times[:, None] - wanted[wanted <= recorded.times[-1] + 1e-9]).argmin(axis=0))
    if len(at) > MOST_FRAMES:
        at = at[np.unique(np.linspace(0, len(at) - 1, MOST_FRAMES).round().astype(int))]
    return recorded.times[at].astype(float), recorded.vertices[at].astype(float)


def points_of(times: Times, surface: Frames, faces: Faces, noise_mm: float = 0.0, seed: int = 0) -> Known:
    """Points of the surface (T, S, 3) m whose places are known: as many as are used of all vertices."""
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(faces), min(MOST_POINTS, len(faces)), replace=False)
    barycentric = np.eye(3)[rng.integers(3, size=len(chosen))]
    positions = np.einsum("nc,tnci->tni", barycentric, surface[:, faces[chosen]])
    positions = positions + 1e-3 * noise_mm * rng.normal(size=positions.shape)
    return Known(times, positions, faces, chosen, barycentric, float(np.hypot(noise_mm, ROUNDING_MM)))


@dataclass(frozen=True)
class CloudView:
    """How a camera sees a body."""

    points: int = 200
    """In each frame."""
    noise_mm: float = 2.0
    """Standard deviation of each coordinate."""
    half: bool = True
    """Only what faces the camera is seen."""
    seed: int = 0


def cloud_of(times: Times, surface: Frames, faces: Faces, view: CloudView) -> Cloud:
    """Points (N, 3) m of each frame of a surface (T, S, 3) m, drawn anew, as a camera at an unknown place has them."""
    rng = np.random.default_rng(view.seed)
    axis = _unit(rng)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    camera = Camera(turn * np.sign(np.linalg.det(turn)), rng.normal(size=3))
    frames = []
    for corners in (there[faces] for there in surface):
        chosen = _drawn(corners, axis if view.half else None, view.points, rng)
        weights = rng.dirichlet(np.ones(3), view.points)
        points = np.einsum("nc,nci->ni", weights, corners[chosen])
        frames.append(camera.points(points + 1e-3 * view.noise_mm * rng.normal(size=points.shape)))
    return Cloud(times, frames, faces, view.noise_mm)


def _unit(rng: np.random.Generator) -> Floats:
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def _drawn(corners: Floats, axis: Floats | None, count: int, rng: np.random.Generator) -> Ints:
    """`count` faces (F, 3, 3) m, by area, of those that face along `axis`."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    if axis is not None:
        facing = normals @ axis > 0.0
        areas = np.where(facing, areas, 0.0) if facing.any() else areas  # of a shell the back is seen as well
    return rng.choice(len(areas), count, p=areas / areas.sum())
