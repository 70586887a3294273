"""One pushed body as an initial value problem dz/dt = f(t, z) with a flat state."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float

from odeform.mechanics.flat import body_motion, parts_of
from odeform.mechanics.push import Push
from odeform.mechanics.pushed_batch import CompiledBodies, PushedBodies, pushed_bodies
from odeform.mechanics.step import Mechanics
from odeform.types import Floats, Rotations, Vectors

__all__ = ["PushedBody"]

FIRST = np.zeros(1, dtype=np.int64)


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
    def _bodies(self) -> PushedBodies | CompiledBodies:
        return pushed_bodies(self.mechanics, self.push, self.pulse)

    @property
    def directions(self) -> int:
        """Number K of directions of deformation."""
        return self.push.eigenvalues.shape[1]

    @property
    def start(self) -> Floats:
        """(20 + 2 K,): at rest."""
        return self._bodies.start[0]

    def __call__(self, time: float, state: Floats) -> Floats:
        """Returns the slope of a state (20 + 2 K,) at `time` in s."""
        return self._bodies(FIRST, np.array([time]), state[None])[0]

    def advance(self, time: float, state: Floats, step: float) -> tuple[Floats, Floats, float]:
        """Returns the state (20 + 2 K,) after `step` seconds, to second order, the slope there, and the error in m.

        The end of the pulse ends a step.
        """
        after, slopes, errors = self._bodies.advance(FIRST, np.array([time]), state[None], np.array([step]))
        return after[0], slopes[0], float(errors[0])

    @property
    def follow(self) -> Callable[..., int] | None:
        """Takes many steps at once; None where steps are not compiled."""
        bodies = self._bodies
        return partial(bodies.follow, 0) if isinstance(bodies, CompiledBodies) else None

    def body_motion(self, states: Float[np.ndarray, "rows state"]) -> tuple[Vectors, Rotations, Floats, Vectors]:
        """Returns `body_motion` of states (T, 20 + 2 K), and the centres of the projectile (T, 3) m."""
        way = states[:, parts_of(states)[3]]
        return *body_motion(states), self.push.centres + way * self.push.guides
