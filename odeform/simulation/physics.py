"""Checks of whether a motion is physically plausible for a soft body. A scene lists those that apply to it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.geometry.shape import surface_weights
from odeform.types import Faces, Floats, Frames, Ints, Mesh, Perpoint, Points, Pose, Times

__all__ = [
    "GRAVITY",
    "STANDARD_CHECKS",
    "PhysicalCheck",
    "SampledMotion",
    "edge_strain",
    "energy_gain",
    "energy_gained",
    "floor_penetration",
    "inverted_faces",
    "volume_drift",
]

GRAVITY = 9.81  # m/s^2, along -z


@dataclass(frozen=True, eq=False)
class SampledMotion:
    """A motion of a mesh, sampled at `times` (T,) s.

    `local` (T, N, 3) m is the deformation of the body that stays in place, `vertices` (T, N, 3) m the whole motion.
    `fine_poses` (F, 4, 4) are the rigid part at `fine_times` (F,) s.
    """

    rest: Mesh
    times: Times
    local: Frames
    vertices: Frames
    fine_times: Float[np.ndarray, " fine"]
    fine_poses: Float[np.ndarray, "fine 4 4"]


@dataclass(frozen=True)
class PhysicalCheck:
    """A figure of a motion that should not exceed `bound`; None: it does not apply. The name ends in the unit."""

    name: str
    bound: float | int
    figure: Callable[[SampledMotion], float | int | None]


def inverted_faces() -> PhysicalCheck:
    """No face turns by more than a right angle against the body."""

    def figure(motion: SampledMotion) -> int:
        points, faces = _points(motion), motion.rest.faces
        normals = _normals(points, faces)
        return max(int(((_normals(points + local, faces) * normals).sum(axis=1) < 0.0).sum()) for local in motion.local)

    return PhysicalCheck("inverted_faces", 0, figure)


def edge_strain(bound: float = 0.5) -> PhysicalCheck:
    """No edge is longer or shorter by more than `bound` of its length at rest."""

    def figure(motion: SampledMotion) -> float:
        points, edges = _points(motion), _edges(motion.rest.faces)
        lengths = _lengths(points, edges)
        return max(float(np.abs(_lengths(points + local, edges) / lengths - 1.0).max()) for local in motion.local)

    return PhysicalCheck("edge_strain", bound, figure)


def volume_drift(bound: float = 0.25) -> PhysicalCheck:
    """The volume that a closed surface encloses changes by at most `bound` of itself."""

    def figure(motion: SampledMotion) -> float | None:
        points, faces = _points(motion), motion.rest.faces
        if not _is_closed(faces):
            return None
        volume = _volume(points, faces)
        return max(abs(_volume(points + local, faces) / volume - 1.0) for local in motion.local)

    return PhysicalCheck("volume_drift", bound, figure)


def floor_penetration(bound_mm: float = 5.0) -> PhysicalCheck:
    """No point is deeper than `bound_mm` below the floor z = 0. The viewer warns at 5 mm; the simulator allows 3."""
    return PhysicalCheck(
        "floor_penetration_mm", bound_mm, lambda motion: max(-1e3 * float(motion.vertices[..., 2].min()), 0.0)
    )


def energy_gain(bound: float = 0.05, gravity: float = GRAVITY, driven: float = 0.1) -> PhysicalCheck:
    """Energy of the rigid motion does not exceed its largest in the fraction `driven` of the time, by more than
    `bound`.

    Until then the body falls or is pushed. Later only elastic energy comes back, and no more than went in.
    """

    def figure(motion: SampledMotion) -> float:
        points = _points(motion)
        return energy_gained(
            motion.fine_times, motion.fine_poses, points, surface_weights(motion.rest), gravity, driven
        )

    return PhysicalCheck("energy_gained_after_impact", bound, figure)


def energy_gained(
    times: Times, poses: Pose, points: Points, mass_fractions: Perpoint, gravity: float = GRAVITY, driven: float = 0.1
) -> float:
    """Measures by how much the energy of the rigid motion later exceeds its largest in the first `driven`; relative.

    `poses` (T, 4, 4) at `times` (T,) s move `points` (N, 3) m, which have `mass_fractions` (N,).
    """
    centre = mass_fractions @ points
    path = poses[:, :3, :3] @ centre + poses[:, :3, 3]
    speed = np.gradient(path, times, axis=0)
    # the angle between two poses, over the time between them
    between = poses[:-1, :3, :3].swapaxes(1, 2) @ poses[1:, :3, :3]
    sine = np.linalg.norm(between - between.swapaxes(1, 2), axis=(1, 2)) / np.sqrt(8.0)
    spin = np.arcsin(np.clip(sine, 0.0, 1.0)) / np.diff(times)
    square = mass_fractions @ ((points - centre) ** 2).sum(axis=1)
    energy = gravity * (path[:, 2] - path[:, 2].min()) + 0.5 * (speed**2).sum(axis=1)
    # the mean moment of inertia over all axes is 2/3 of the mean square distance
    energy[1:] += square / 3.0 * spin**2
    first = times <= times[0] + driven * (times[-1] - times[0])
    return float(energy[~first].max() / energy[first].max() - 1.0)


def _points(motion: SampledMotion) -> Points:
    return np.asarray(motion.rest.points, dtype=float)


def _edges(faces: Faces) -> Ints:
    """(E, 2) unique pairs of vertices."""
    return np.unique(_sides(faces), axis=0)


def _sides(faces: Faces) -> Ints:
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.sort(pairs, axis=1)


def _is_closed(faces: Faces) -> bool:
    """Whether each edge belongs to exactly two faces."""
    return bool((np.unique(_sides(faces), axis=0, return_counts=True)[1] == 2).all())


def _lengths(points: Points, edges: Ints) -> Floats:
    return np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)


def _normals(points: Points, faces: Faces) -> Floats:
    """(F, 3) outward normals of twice the area."""
    a, b, c = (points[faces[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def _volume(points: Points, faces: Faces) -> float:
    return float((_normals(points, faces) * points[faces[:, 0]]).sum()) / 6.0


STANDARD_CHECKS = (inverted_faces(), edge_strain(), volume_drift(), floor_penetration(), energy_gain())
"""Checks a soft body over a floor under standard gravity."""
