"""Whether motions within the trained box look like motions of a body: figures of the model at hand."""

import numpy as np

from odeform.geometry.shape import surface_weights
from odeform.models.base import Predictor
from odeform.simulation.objects.ball import GRAVITY
from odeform.stress.cases import inside
from odeform.stress.check import Check, Checks
from odeform.types import Faces, Floats, Ints, Perpoint, Points, Pose, Times

__all__ = ["check_physics", "energy_gained"]

DRAWS = 24


def check_physics(predictor: Predictor, seed: int = 0) -> Checks:
    """The worst of some motions, at the trained frames.

    `inverted_faces`: those turned by more than a right angle against the body. Bounds: no face inverts; no edge is
    longer or shorter by half; the volume changes by no more than the quarter by which a ball may flatten; 5 mm below
    the floor are what the viewer remarks (the simulator lets in up to 3); a twentieth of the energy is not noticed.
    """
    rest, times = predictor.rest, predictor.schema.window.times
    fine = np.linspace(times[0], times[-1], 4 * len(times) - 3)
    edges = _edges(rest.faces)
    points = np.asarray(rest.points, dtype=float)
    lengths, normals, volume = _lengths(points, edges), _normals(points, rest.faces), _volume(points, rest.faces)
    inverted, strain, drift, depth, gained = 0, 0.0, 0.0, 0.0, 0.0
    for parameters in inside(predictor.schema, DRAWS, seed):
        motion = predictor.solve(None, parameters)
        for time in times:
            body = points + motion.local(float(time))
            facing = (_normals(body, rest.faces) * normals).sum(axis=1)
            inverted = max(inverted, int((facing < 0.0).sum()))
            strain = max(strain, float(np.abs(_lengths(body, edges) / lengths - 1.0).max()))
            drift = max(drift, abs(_volume(body, rest.faces) / volume - 1.0))
        depth = max(depth, -float(motion.vertices(times)[..., 2].min()))
        gained = max(gained, energy_gained(fine, motion.pose(fine), points, surface_weights(rest)))
    return {
        "inverted_faces": Check(inverted, 0),
        "edge_strain": Check(strain, 0.5),
        "volume_drift": Check(drift, 0.25),
        "floor_penetration_mm": Check(1e3 * depth, 5.0),
        "energy_gained_after_impact": Check(gained, 0.05),
    }


def energy_gained(times: Times, poses: Pose, points: Points, shares: Perpoint) -> float:
    """By how much the energy of the rigid motion later exceeds its largest in the first tenth of the time; relative.

    Until then a ball falls or is being kicked; later only elastic energy may come back, and no more than went in.
    `poses` (T, 4, 4) at `times` (T,) move `points` (N, 3), which have their `shares` (N,) of the mass.
    """
    centre = shares @ points
    path = poses[:, :3, :3] @ centre + poses[:, :3, 3]
    speed = np.gradient(path, times, axis=0)
    # the angle between two poses, over the time between them; a shell turns as 2/3 of its mass at its radius
    between = poses[:-1, :3, :3].swapaxes(1, 2) @ poses[1:, :3, :3]
    sine = np.linalg.norm(between - between.swapaxes(1, 2), axis=(1, 2)) / np.sqrt(8.0)
    spin = np.arcsin(np.clip(sine, 0.0, 1.0)) / np.diff(times)
    radius = shares @ ((points - centre) ** 2).sum(axis=1)
    energy = GRAVITY * (path[:, 2] - path[:, 2].min()) + 0.5 * (speed**2).sum(axis=1)
    energy[1:] += radius / 3.0 * spin**2
    first = times <= times[0] + 0.1 * (times[-1] - times[0])
    return float(energy[~first].max() / energy[first].max() - 1.0)


def _edges(faces: Faces) -> Ints:
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def _lengths(points: Points, edges: Ints) -> Floats:
    return np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)


def _normals(points: Points, faces: Faces) -> Floats:
    """(F, 3), of twice the area."""
    a, b, c = (points[faces[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def _volume(points: Points, faces: Faces) -> float:
    return float((_normals(points, faces) * points[faces[:, 0]]).sum()) / 6.0
