"""One pushed body as an initial value problem dz/dt = f(t, z) with a flat state."""

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.mechanics.push import Push
from odeform.mechanics.state import State
from odeform.mechanics.step import Mechanics, Steps
from odeform.mechanics.turns import skew
from odeform.types import Floats, Rotations, Vectors

__all__ = ["PushedBody"]


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
        return np.concatenate([np.zeros(3), np.eye(3).ravel(), np.zeros(8 + 2 * self.directions)])

    def __call__(self, time: float, state: Floats) -> Floats:
        """The slope of a state (20 + 2 K,) at `time` in s."""
        now = self._unpacked(state, time < self.pulse)
        return self._slope(now, self._steps.slope(now)[0])

    def advance(self, time: float, state: Floats, step: float) -> tuple[Floats, Floats, float]:
        """The state (20 + 2 K,) after `step` seconds, to second order, the slope there, and the error in m.

        The end of the pulse ends a step.
        """
        left, first = min(max(self.pulse - time, 0.0), step), 0.0
        if left > 1e-9:
            state, slope, first = self._step(state, True, left)
            if step - left <= 1e-9:
                return state, slope, first
        state, slope, second = self._step(state, False, step - left)
        return state, slope, first + second

    def _step(self, state: Floats, pushing: bool, step: float) -> tuple[Floats, Floats, float]:
        now = self._unpacked(state, pushing)
        after, error = self._steps.advance(now, step)
        slope = self._slope(after, (after.velocity - now.velocity)[0] / step)
        return self._packed(after, state), slope, float(error[0])

    @cached_property
    def _parts(self) -> tuple[slice, ...]:
        """Of a flat state: shift, rotation, deformation, projectile, and velocities."""
        ends = np.cumsum([0, 3, 9, self.directions, 1, 7 + self.directions])
        return tuple(slice(int(a), int(b)) for a, b in itertools.pairwise(ends))

    def _unpacked(self, state: Floats, pushing: bool) -> State:
        shift, turn, modes, projectile, velocity = (state[None, part] for part in self._parts)
        whole = State(shift, turn.reshape(1, 3, 3), modes, projectile, velocity)
        return whole if pushing else whole.without_projectile()

    def _packed(self, after: State, before: Floats) -> Floats:
        kept = before[len(before) - 7 - self.directions + after.velocity.shape[1] :]
        parts = (after.shift, after.rotation, after.modes, after.projectile, after.velocity)
        return np.concatenate([*(part.ravel() for part in parts), kept])

    def _slope(self, now: State, acceleration: Floats) -> Floats:
        """Flat, from the accelerations (V,)."""
        velocity, missing = now.velocity[0], np.zeros(7 + self.directions - len(acceleration))
        turn = (skew(velocity[3:6]) @ now.rotation[0]).ravel()
        speed = velocity[now.body :] if now.pushed else np.zeros(1)
        return np.concatenate([velocity[:3], turn, velocity[6 : now.body], speed, acceleration, missing])

    def body_motion(self, states: Float[np.ndarray, "times state"]) -> tuple[Vectors, Rotations, Floats, Vectors]:
        """Shifts (T, 3) m, rotations (T, 3, 3), amplitudes of the directions of deformation (T, K) and centres of the
        projectile (T, 3) m of states (T, 20 + 2 K). Interpolated rotations are made orthonormal."""
        shift, turn, amplitudes, way, _ = (states[:, part] for part in self._parts)
        left, _, right = np.linalg.svd(turn.reshape(-1, 3, 3))
        return shift, left @ right, amplitudes, self.push.centres + way * self.push.guides
