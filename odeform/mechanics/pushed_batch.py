"""Many pushed bodies as initial value problems with flat states, each with steps of its own."""

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float, Int

from odeform.compiling import compiles
from odeform.mechanics.flat import flat_slopes, packed, unpacked
from odeform.mechanics.floor import GRAVITY
from odeform.mechanics.holding import no_hold
from odeform.mechanics.push import Patch, Push
from odeform.mechanics.step import Mechanics, Steps
from odeform.mechanics.touching import most_contacts

if TYPE_CHECKING:
    from odeform.mechanics.compiled_contacts import Constants

__all__ = ["CompiledBodies", "PushedBodies", "pushed_bodies"]

SHORTEST = 1e-9  # s; what is left of a pulse or of a step counts from here on

Rows = Int[np.ndarray, " rows"]
Each = Float[np.ndarray, " rows"]
States = Float[np.ndarray, "rows state"]


class PushedBodies:
    """B pushes of a body at rest, as `PushedBody` is one of them, in NumPy. It is a `StiffBatchField`."""

    def __init__(self, mechanics: Mechanics, push: Push, pulse: float) -> None:
        """Projectiles push for `pulse` seconds from time 0 on."""
        self._mechanics, self._push, self._pulse = mechanics, push, pulse
        self._preload = mechanics.preload(push)
        self._known: dict[bool, tuple[bytes, Steps]] = {}

    @property
    def start(self) -> Float[np.ndarray, "batch state"]:
        """(B, 20 + 2 K): at rest."""
        return self._mechanics.start(self._push)

    def __call__(self, rows: Rows, times: Each, states: States) -> States:
        """The slopes of states (R, 20 + 2 K) at `times` (R,) in s of the pushes `rows`."""
        out = np.empty_like(states)
        for pushing in (True, False):
            some = (times < self._pulse) == pushing
            if some.any():
                now = unpacked(states[some], pushing)
                out[some] = flat_slopes(now, self._steps(rows[some], pushing).slope(now, times[some]))
        return out

    def advance(self, rows: Rows, times: Each, states: States, steps: Each) -> tuple[States, States, Each]:
        """States (R, 20 + 2 K) after `steps` (R,) s, to second order, slopes there, and errors (R,) in m.

        The end of the pulse ends a step.
        """
        left = np.minimum(np.maximum(self._pulse - times, 0.0), steps)
        out = states, np.empty_like(states), np.zeros(len(rows))
        pushed = left > SHORTEST
        out = self._advanced(rows, out, pushed, True, times, left)
        out = self._advanced(rows, out, ~pushed | (steps - left > SHORTEST), False, times + left, steps - left)
        return _followed(self._push, times, steps, out)

    def _advanced(
        self,
        rows: Rows,
        known: tuple[States, States, Each],
        some: Bool[np.ndarray, " rows"],
        pushing: bool,
        times: Each,
        steps: Each,
    ) -> tuple[States, States, Each]:
        """Some of the states go on from `times`; states, slopes and errors of all."""
        if not some.any():
            return known
        states, slopes, errors = (values.copy() for values in known)
        now, step = unpacked(states[some], pushing), steps[some]
        after, error = self._steps(rows[some], pushing).advance(now, step, times[some])
        slopes[some] = flat_slopes(after, (after.velocity - now.velocity) / step[:, None])
        states[some] = packed(after, states[some])
        errors[some] += error
        return states, slopes, errors

    def _steps(self, rows: Rows, pushing: bool) -> Steps:
        """The last one is kept for each phase: what it holds is large, and the same until a motion ends."""
        key, (last, steps) = rows.tobytes(), self._known.get(pushing, (b"", None))
        if steps is None or last != key:
            whole = self._push if pushing else self._push.over
            some = whole if len(rows) == len(whole.eigenvalues) else whole.some(rows)
            steps = Steps(self._mechanics, some, self._preload[rows])
            self._known[pushing] = key, steps
        return steps


class CompiledBodies:
    """Computes what `PushedBodies` does, in machine code; every motion is as it would be alone, to the bit."""

    def __init__(self, mechanics: Mechanics, push: Push, pulse: float) -> None:
        """Projectiles push for `pulse` seconds from time 0 on."""
        self._mechanics, self._push, self._pulse = mechanics, push, pulse

    @cached_property
    def constants(self) -> "Constants":
        """What steps in machine code take."""
        from odeform.mechanics.compiled_contacts import Constants  # importing Numba takes half a second

        mechanics, push, parameters = self._mechanics, self._push, self._mechanics.parameters
        solid, floor, stands = mechanics.body.solid, mechanics.floor, push.support
        batch, size = push.eigenvalues.shape
        patch = push.patch or Patch(np.zeros((batch, 3)), np.zeros((batch, 6, size)), np.zeros((batch, 3)), 0.0)
        hold = push.hold or no_hold(batch, size)
        spread = np.full(6 + push.eigenvalues.shape[1], 1.0 / solid.mass)
        spread[:3], spread[3:6] = 1.0, np.diag(solid.inertia) / solid.mass
        stiffness, grip = parameters.push_stiffness * push.masses, parameters.push_regularisation * push.masses
        stiffness[:, :stands], grip[:, :stands] = (
            floor.stiffness,
            parameters.floor_regularisation * push.masses[:, :stands],
        )
        return Constants(
            points=push.points,
            rows=push.rows,
            extents=np.sqrt(np.einsum("bask,bask->bs", push.rows[:, :3], push.rows[:, :3])),
            stiffness=stiffness,
            grip=grip,
            level=floor.level,
            eigenvalues=parameters.stiffness * push.eigenvalues,
            preload=mechanics.preload(push),
            inertia=np.ascontiguousarray(solid.inertia, dtype=float),
            spread=spread,
            centres=np.ascontiguousarray(push.centres, dtype=float),
            guides=np.ascontiguousarray(push.guides, dtype=float),
            forces=push.forces[:, 0].astype(float),
            mass=float(solid.mass),
            gravity=GRAVITY,
            relaxation=float(mechanics.relaxation),
            floor_damping=parameters.floor_damping,
            floor_friction=parameters.floor_friction,
            push_damping=parameters.push_damping,
            push_friction=parameters.push_friction,
            radius=mechanics.projectile.radius,
            projectile=mechanics.projectile.mass,
            reach=mechanics.body.reach,
            pulse=self._pulse,
            onset=0.0 if mechanics.lands else parameters.floor_damping,
            most=most_contacts(stands),
            obstacles=np.zeros((batch, 0, 6, 3)) if push.obstacles is None else push.obstacles.packed,
            patch_points=patch.points,
            patch_rows=patch.rows,
            patch_forces=patch.forces,
            patch_pulse=patch.duration,
            hold_points=hold.points,
            hold_rows=hold.rows,
            hold_stiffness=hold.stiffness,
            hold_places=hold.places,
            hold_damping=hold.damping,
        )

    @property
    def start(self) -> Float[np.ndarray, "batch state"]:
        """(B, 20 + 2 K): at rest."""
        return self._mechanics.start(self._push)

    def __call__(self, rows: Rows, times: Each, states: States) -> States:
        """The slopes of states (R, 20 + 2 K) at `times` (R,) in s of the pushes `rows`."""
        from odeform.mechanics.compiled_push import slope_of

        out = np.empty_like(states)
        slope_of(self.constants, rows, times, states, out)
        return out

    def advance(self, rows: Rows, times: Each, states: States, steps: Each) -> tuple[States, States, Each]:
        """States (R, 20 + 2 K) after `steps` (R,) s, to second order, slopes there, and errors (R,) in m.

        The end of the pulse ends a step.
        """
        from odeform.mechanics.compiled_push import advance_all

        out, slopes, errors = np.empty_like(states), np.empty_like(states), np.empty(len(rows))
        advance_all(self.constants, rows, times, states, steps, out, slopes, errors)
        return _followed(self._push, times, steps, (out, slopes, errors))

    def follow(self, row: int, control: tuple[float, ...], *nodes: np.ndarray) -> int:
        """Many steps of the push `row`, see `odeform.mechanics.compiled_push.follow`."""
        from odeform.mechanics.compiled_push import follow

        return follow(self.constants, row, control, *nodes)


def _followed(push: Push, times: Each, steps: Each, out: tuple[States, States, Each]) -> tuple[States, States, Each]:
    """What a step returns, with an error for those that pass over a pulse."""
    states, slopes, errors = out
    return states, slopes, errors if push.patch is None else push.patch.followed(times, steps, errors)


def pushed_bodies(mechanics: Mechanics, push: Push, pulse: float) -> PushedBodies | CompiledBodies:
    """B pushes of a body at rest, compiled where that is possible."""
    return (CompiledBodies if compiles() else PushedBodies)(mechanics, push, pulse)
