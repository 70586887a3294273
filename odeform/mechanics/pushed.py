"""One pushed body as an initial value problem dz/dt = f(t, z) with a flat state."""

import itertools
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from jaxtyping import Float

from odeform.mechanics.push import Push
from odeform.mechanics.state import State
from odeform.mechanics.step import Mechanics, Steps
from odeform.mechanics.turns import skew
from odeform.types import Floats, Rotations, Vectors

__all__ = ["SHORTEST", "PushedBody", "body_motion", "flat_slopes", "packed", "start_of", "unpacked"]

States = Float[np.ndarray, "rows state"]

SHORTEST = 1e-9  # s; what is left of a pulse or of a step counts from here on


@dataclass(frozen=True, eq=False)
class PushedBody:
    """A body at rest that a projectile pushes from time 0 on, for `pulse` seconds. It is a `StiffField`.

    The state z holds, in this order: shift (3), rotation (9), amplitudes of the push's directions of deformation (K),
    the projectile's way along its guide (1), and the velocities of `State` (7 + K). That of the projectile is kept when
    it is gone.
    """

    mechanics: Mechanics
    push: Push
    """One push."""
    pulse: float

    @cached_property
    def _steps(self) -> Steps:
        return Steps(self.mechanics, self.push)

    @property
    def directions(self) -> int:
        """Number K of directions of deformation."""
        return self.push.squares.shape[1]

    @property
    def start(self) -> Floats:
        """(20 + 2 K,): at rest."""
        return start_of(self.directions)

    def __call__(self, time: float, state: Floats) -> Floats:
        """The slope of a state (20 + 2 K,) at `time` in s."""
        now = unpacked(state[None], bool(time < self.pulse))
        return flat_slopes(now, self._steps.slope(now))[0]

    def advance(self, time: float, state: Floats, step: float) -> tuple[Floats, Floats, float]:
        """The state (20 + 2 K,) after `step` seconds, to second order, the slope there, and the error in m.

        The end of the pulse ends a step.
        """
        left, first = min(max(self.pulse - time, 0.0), step), 0.0
        if left > SHORTEST:
            state, slope, first = self._step(state, True, left)
            if step - left <= SHORTEST:
                return state, slope, first
        state, slope, second = self._step(state, False, step - left)
        return state, slope, first + second

    def _step(self, state: Floats, pushing: bool, step: float) -> tuple[Floats, Floats, float]:
        now = unpacked(state[None], pushing)
        after, error = self._steps.advance(now, step)
        slope = flat_slopes(after, (after.velocity - now.velocity) / step)[0]
        return packed(after, state[None])[0], slope, float(error[0])

    def body_motion(self, states: States) -> tuple[Vectors, Rotations, Floats, Vectors]:
        """As `body_motion` of states (T, 20 + 2 K), and the centres of the projectile (T, 3) m."""
        way = states[:, _parts(states)[3]]
        return *body_motion(states), self.push.centres + way * self.push.guides


def start_of(directions: int) -> Floats:
    """(20 + 2 K,): the state of a body at rest with K directions of deformation."""
    return np.concatenate([np.zeros(3), np.eye(3).ravel(), np.zeros(8 + 2 * directions)])


def _parts(states: States) -> tuple[slice, ...]:
    """Of flat states: shift, rotation, deformation, projectile, and velocities."""
    return _slices((states.shape[1] - 20) // 2)


@cache
def _slices(directions: int) -> tuple[slice, ...]:
    ends = np.cumsum([0, 3, 9, directions, 1, 7 + directions])
    return tuple(slice(int(a), int(b)) for a, b in itertools.pairwise(ends))


def unpacked(states: States, pushing: bool) -> State:
    """From flat states (R, 20 + 2 K), with or without the projectile."""
    shift, turn, modes, projectile, velocity = (states[:, part] for part in _parts(states))
    whole = State(shift, turn.reshape(-1, 3, 3), modes, projectile, velocity)
    return whole if pushing else whole.without_projectile()


def packed(after: State, before: States) -> States:
    """Flat states (R, 20 + 2 K). The speed of a projectile that is gone is as it was `before`."""
    kept = before[:, before.shape[1] - 7 - after.modes.shape[1] + after.velocity.shape[1] :]
    turn = after.rotation.reshape(len(before), 9)
    return np.concatenate([after.shift, turn, after.modes, after.projectile, after.velocity, kept], axis=1)


def flat_slopes(now: State, acceleration: Float[np.ndarray, "rows velocities"]) -> States:
    """(R, 20 + 2 K), from the accelerations."""
    velocity, count = now.velocity, len(now.velocity)
    turn = (skew(velocity[:, 3:6]) @ now.rotation).reshape(count, 9)
    speed = velocity[:, now.body :] if now.pushed else np.zeros((count, 1))
    missing = np.zeros((count, now.body + 1 - acceleration.shape[1]))
    return np.concatenate([velocity[:, :3], turn, velocity[:, 6 : now.body], speed, acceleration, missing], axis=1)


def body_motion(states: States) -> tuple[Vectors, Rotations, Floats]:
    """Shifts (T, 3) m, rotations (T, 3, 3) and amplitudes of the directions of deformation (T, K) of flat states
    (T, 20 + 2 K). Interpolated rotations are made orthonormal."""
    shift, turn, amplitudes, *_ = (states[:, part] for part in _parts(states))
    left, _, right = np.linalg.svd(turn.reshape(-1, 3, 3))
    return shift, left @ right, amplitudes
