"""States of pushed bodies as flat arrays, as solvers know them."""

import itertools
from functools import cache

import numpy as np
from jaxtyping import Float

from odeform.mechanics.rotations import skew
from odeform.mechanics.state import State
from odeform.types import Floats, Rotations, Vectors

__all__ = ["body_motion", "flat_slopes", "packed", "parts_of", "start_of", "unpacked"]

States = Float[np.ndarray, "rows state"]


def start_of(directions: int) -> Floats:
    """(20 + 2 K,): the state of a body at rest with K directions of deformation."""
    return np.concatenate([np.zeros(3), np.eye(3).ravel(), np.zeros(8 + 2 * directions)])


def parts_of(states: States) -> tuple[slice, ...]:
    """Slices flat states: shift, rotation, deformation, projectile, and velocities."""
    return _slices((states.shape[1] - 20) // 2)


@cache
def _slices(directions: int) -> tuple[slice, ...]:
    ends = np.cumsum([0, 3, 9, directions, 1, 7 + directions])
    return tuple(slice(int(a), int(b)) for a, b in itertools.pairwise(ends))


def unpacked(states: States, pushing: bool) -> State:
    """Reads flat states (R, 20 + 2 K), with or without the projectile."""
    shift, turn, modes, projectile, velocity = (states[:, part] for part in parts_of(states))
    whole = State(shift, turn.reshape(-1, 3, 3), modes, projectile, velocity)
    return whole if pushing else whole.without_projectile()


def packed(after: State, before: States) -> States:
    """Flat states (R, 20 + 2 K). The speed of a projectile that is gone is as it was `before`."""
    kept = before[:, before.shape[1] - 7 - after.modes.shape[1] + after.velocity.shape[1] :]
    turn = after.rotation.reshape(len(before), 9)
    return np.concatenate([after.shift, turn, after.modes, after.projectile, after.velocity, kept], axis=1)


def flat_slopes(now: State, acceleration: Float[np.ndarray, "rows velocities"]) -> States:
    """Computes (R, 20 + 2 K), from the accelerations."""
    velocity, count = now.velocity, len(now.velocity)
    turn = (skew(velocity[:, 3:6]) @ now.rotation).reshape(count, 9)
    speed = velocity[:, now.body :] if now.pushed else np.zeros((count, 1))
    missing = np.zeros((count, now.body + 1 - acceleration.shape[1]))
    return np.concatenate([velocity[:, :3], turn, velocity[:, 6 : now.body], speed, acceleration, missing], axis=1)


def body_motion(states: States) -> tuple[Vectors, Rotations, Floats]:
    """Shifts (T, 3) m, rotations (T, 3, 3) and amplitudes of the directions of deformation (T, K) of flat states
    (T, 20 + 2 K). Interpolated rotations are made orthonormal."""
    shift, turn, amplitudes, *_ = (states[:, part] for part in parts_of(states))
    left, _, right = np.linalg.svd(turn.reshape(-1, 3, 3))
    return shift, left @ right, amplitudes
