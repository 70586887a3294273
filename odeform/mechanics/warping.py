"""Modal warping: large bending from modes that are linear (Choi and Ko 2005, Modal warping, IEEE TVCG 11).

A mode turns the surface as well as moving it. A point that turns on its way moves along an arc: a head that tilts keeps
its size, a strap that is pushed slips off.
"""

import numpy as np
from jaxtyping import Float
from scipy.sparse import csr_array

from odeform.mechanics.rotations import skew
from odeform.mechanics.state import State
from odeform.types import Faces, Floats, Points

__all__ = ["Turning", "bent", "surface_turns"]

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


class Turning:
    """Points that turn evenly by (..., 3, N) rad as they move."""

    def __init__(self, turns: Float[np.ndarray, "*batch 3 points"]) -> None:
        self._turns = turns
        self._squares = (turns * turns).sum(axis=-2, keepdims=True) + SMALL * SMALL
        angle = np.sqrt(self._squares)
        half = np.sin(0.5 * angle) / angle
        self._once, self._twice = np.sin(angle) / angle, 2.0 * half * half

    def warped(self, displacement: Float[np.ndarray, "*batch 3 points"]) -> Float[np.ndarray, "*batch 3 points"]:
        """Moves points by displacements of the modes, which do not turn with them."""
        turns, rest = self._turns, 1.0 - self._once
        cross = turns[..., AFTER, :] * displacement[..., BEFORE, :]
        cross -= turns[..., BEFORE, :] * displacement[..., AFTER, :]
        along = (turns * displacement).sum(axis=-2, keepdims=True) * (rest / self._squares)
        return self._once * displacement + self._twice * cross + along * turns

    @property
    def rotations(self) -> Float[np.ndarray, "*batch points 3 3"]:
        """Rotates each point, once it has moved."""
        turns = self._turns.swapaxes(-1, -2)
        once, twice = self._once.swapaxes(-1, -2), self._twice.swapaxes(-1, -2)
        out = (twice * turns)[..., None] * turns[..., None, :]
        out += skew(once * turns)
        out.reshape(*turns.shape[:-1], 9)[..., ::4] += 1.0 - twice * self._squares.swapaxes(-1, -2)
        return out


def bent(points: Floats, rows: Floats, state: State) -> tuple[Turning, Float[np.ndarray, "batch 3 samples"]]:
    """How much samples (B, 3, S) turn, and where they are, in m from the mass centre, for rows (B, 6, S, K)."""
    batch, _, samples, size = rows.shape
    motion = (rows.reshape(batch, 6 * samples, size) @ state.modes[..., None]).reshape(batch, 6, samples)
    turning = Turning(motion[:, 3:])
    return turning, points + turning.warped(motion[:, :3])
