"""Finds where a camera stood from a cloud of the body at rest: turns are tried, each is refined (point to plane)."""

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from odeform.identification.pushed.state import Camera
from odeform.types import Floats, Mesh, Points

__all__ = ["cameras_of"]

TURNS, ROUNDS, REFINED = 96, 6, 12
LONGER = 24  # rounds for the best
APART = 0.05  # of the cloud's size, RMS, between cameras that are not the same
SAMPLES = 80  # points of the cloud while turns are compared


def cameras_of(cloud: Points, rest: Mesh, count: int, seed: int = 0) -> list[Camera]:
    """At most `count` cameras, apart from each other, for a cloud (N, 3) m of some of a body at rest, best first.

    A shape with symmetries has several that are alike.
    """
    corners = np.asarray(rest.points, dtype=float)[rest.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
    middles = corners.mean(axis=1)
    surface = KDTree(middles), middles, normals
    turns = Rotation.random(TURNS, rng=np.random.default_rng(seed)).as_matrix()
    few = cloud[:: max(len(cloud) // SAMPLES, 1)]
    centre = middles.mean(axis=0)
    tried = [_refined(Camera(turn, centre - turn @ cloud.mean(axis=0)), few, surface, ROUNDS) for turn in turns]
    longer = [_refined(camera, cloud, surface, LONGER) for camera in _apart(tried, few)[:REFINED]]
    return _apart(longer, few)[:count]


def _apart(found: list[tuple[float, Camera]], cloud: Points) -> list[Camera]:
    """Those that see a cloud elsewhere than all better ones do: most turns lead to the same few places."""
    kept, places = list[Camera](), list[Points]()
    size = float(np.ptp(cloud, axis=0).max())
    for _, camera in sorted(found, key=lambda one: one[0]):
        seen = camera.points(cloud)
        if all(np.sqrt(((seen - one) ** 2).sum(axis=1).mean()) > APART * size for one in places):
            kept.append(camera)
            places.append(seen)
    return kept


def _refined(
    camera: Camera, cloud: Points, surface: tuple[KDTree, Floats, Floats], rounds: int
) -> tuple[float, Camera]:
    tree, middles, normals = surface
    about = middles.mean(axis=0)
    for _ in range(rounds):
        seen = camera.points(cloud)
        near = tree.query(seen)[1]
        normal, arms = normals[near], seen - about
        rows = np.concatenate([normal, np.cross(arms, normal)], axis=1)
        off = ((middles[near] - seen) * normal).sum(axis=1)
        scale = 1.4826 * float(np.median(np.abs(off))) + 1e-4
        weights = 1.0 / (1.0 + (off / (3.0 * scale)) ** 2)
        normal_matrix = rows.T @ (weights[:, None] * rows) + 1e-6 * np.eye(6)
        camera = camera.moved(np.linalg.solve(normal_matrix, rows.T @ (weights * off)), about)
    away = tree.query(camera.points(cloud))[0]
    return float(np.mean(np.minimum(away, 0.03) ** 2)), camera
