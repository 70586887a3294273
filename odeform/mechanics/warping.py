"""Modal warping: large bending from modes that are linear (Choi and Ko 2005, Modal warping, IEEE TVCG 11).

A mode turns the surface as well as moving it. A point that turns on its way moves along an arc: a head that tilts keeps
its size, a strap that is pushed slips off.
"""

import numpy as np
from jaxtyping import Float
from scipy.sparse import csr_array

from odeform.mechanics.turns import skew
from odeform.types import Faces, Floats, Points, Rotations

__all__ = ["rotations", "surface_turns", "warped"]

SMALL = 1e-9  # rad, in place of 0 / 0
AFTER, BEFORE = [1, 2, 0], [2, 0, 1]  # of each axis, in a cross product
SLACK = 1e-6  # relative; edges in one line say nothing about the turn around it


def surface_turns(points: Points, faces: Faces, shapes: Float[np.ndarray, "points 3 modes"]) -> Floats:
    """(N, 3, K) by how much displacements turn the surface at its points (N, 3) m, in rad per unit of each mode: the
    small rotation that fits the edges there best."""
    edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    here, there = np.concatenate([edges, edges[:, ::-1]]).T
    cross = skew(points[there] - points[here])
    weights = 1.0 / np.maximum(((points[there] - points[here]) ** 2).sum(axis=1), 1e-12)
    gather = csr_array((weights, (here, np.arange(len(here)))), shape=(len(points), len(here)))
    matrix = (gather @ -(cross @ cross).reshape(-1, 9)).reshape(-1, 3, 3)
    matrix += SLACK * np.trace(matrix, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    moments = cross @ (shapes[there] - shapes[here])
    return np.linalg.solve(matrix, (gather @ moments.reshape(len(here), -1)).reshape(shapes.shape))


def warped(displacement: Floats, turns: Floats) -> Floats:
    """(..., 3, N) displacements of points that turn evenly by (..., 3, N) rad as they move."""
    squares = (turns * turns).sum(axis=-2, keepdims=True) + SMALL * SMALL
    angle = np.sqrt(squares)
    half = np.sin(0.5 * angle) / angle
    even = (1.0 - np.sin(angle) / angle) / squares
    once = turns[..., AFTER, :] * displacement[..., BEFORE, :] - turns[..., BEFORE, :] * displacement[..., AFTER, :]
    along = (turns * displacement).sum(axis=-2, keepdims=True)
    return (1.0 - even * squares) * displacement + (2.0 * half * half) * once + (even * along) * turns


def rotations(turns: Floats) -> Rotations:
    """(..., 3) rotation vectors in rad -> (..., 3, 3)."""
    angle = (np.sqrt((turns * turns).sum(axis=-1)) + SMALL)[..., None, None]
    cross = skew(turns)
    half = np.sin(0.5 * angle) / angle
    return np.eye(3) + (np.sin(angle) / angle) * cross + (2.0 * half * half) * (cross @ cross)
