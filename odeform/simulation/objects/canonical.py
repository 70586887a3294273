"""Finds which of the seven objects a shape is most like, and how it is turned to lie as that one does."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from odeform.errors import InputError
from odeform.geometry.rigid import rotation_z
from odeform.geometry.similarity import UPRIGHT
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.types import Floats, Points, Rotations

__all__ = ["SOLIDS", "UNITS", "distances_to", "most_like", "plausible_scale"]

SOLIDS = tuple(name for name in OBJECTS if name != "chip")
"""The classes that a closed mesh can be: a chip is a shell."""
AZIMUTHS = 12
SAMPLES = 400  # points of each shape that are compared
SMALLEST, LARGEST = 0.04, 0.7  # m, extent of a body on which a sphere of 20 mm leaves a dent
UNITS = {1.0: "metres", 1e-3: "millimetres", 1e-2: "centimetres"}  # by m


def most_like(points: Points, like: str | None, up: str) -> tuple[str, Rotations]:
    """The class and the rotation (3, 3) with the least mean distance between the surfaces, both scaled to one size.

    `points` (N, 3) are even on the surface. `like` names the class, where it is known; `up` is the axis of the shape
    that points up, as "+y". Raises `InputError` for unknown names.
    """
    if like is not None and like not in SOLIDS:
        raise InputError(f"like {like!r}: expected one of {', '.join(SOLIDS)}")
    if up not in UPRIGHT:
        raise InputError(f"up {up!r}: expected one of {', '.join(UPRIGHT)}")
    shape = _normalised(points)
    best = (math.inf, SOLIDS[0], np.eye(3))
    for name in SOLIDS if like is None else (like,):
        body = _normalised(np.asarray(get_object(name).rest_mesh().points, dtype=float))
        tree = KDTree(body)
        for azimuth in range(AZIMUTHS):
            rotation = rotation_z(2.0 * math.pi * azimuth / AZIMUTHS) @ UPRIGHT[up]
            distance = _distance(shape @ rotation.T, body, tree)
            best = min(best, (distance, name, rotation), key=lambda found: found[0])
    return best[1], best[2]


def distances_to(points: Points, names: Sequence[str]) -> dict[str, float]:
    """The mean distance of a surface (N, 3), as it lies, from that of each named object, all scaled to one size."""
    shape = _normalised(np.asarray(points, dtype=float))
    bodies = {name: _normalised(np.asarray(get_object(name).rest_mesh().points, dtype=float)) for name in names}
    return {name: 0.5 * _distance(shape, body, KDTree(body)) for name, body in bodies.items()}


def _distance(shape: Floats, body: Floats, tree: KDTree) -> float:
    """The mean distances of each from the other, added; `tree` is that of the body."""
    return float(tree.query(shape)[0].mean() + KDTree(shape).query(body)[0].mean())


def plausible_scale(extent: float, like: str) -> float:
    """Metres of one unit of a mesh with this largest `extent`: the first usual unit that makes a body of 4 to 70 cm.

    Without such a unit, the mesh gets the size of the object it is `like`.
    """
    fitting = (unit for unit in UNITS if SMALLEST <= extent * unit <= LARGEST)
    return next(fitting, float(np.ptp(get_object(like).settled, axis=0).max()) / extent)


def _normalised(points: Points) -> Floats:
    """About `SAMPLES` of the points, of size 1 (RMS distance from the mean) around the origin."""
    chosen = points[:: max(len(points) // SAMPLES, 1)]
    centred = chosen - points.mean(axis=0)
    return centred / np.sqrt((centred**2).sum(axis=1).mean())
