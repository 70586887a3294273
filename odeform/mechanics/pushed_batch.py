"""Many pushed bodies as initial value problems with flat states, each with steps of its own."""

import numpy as np
from jaxtyping import Bool, Float, Int

from odeform.mechanics.push import Push
from odeform.mechanics.pushed import SHORTEST, flat_slopes, packed, start_of, unpacked
from odeform.mechanics.step import Mechanics, Steps

__all__ = ["PushedBodies"]

Rows = Int[np.ndarray, " rows"]
Each = Float[np.ndarray, " rows"]
States = Float[np.ndarray, "rows state"]


class PushedBodies:
    """B pushes of a body at rest, as `PushedBody` is one of them. It is a `StiffBatchField`."""

    def __init__(self, mechanics: Mechanics, push: Push, pulse: float) -> None:
        """Projectiles push for `pulse` seconds from time 0 on."""
        self._mechanics, self._push, self._pulse = mechanics, push, pulse
        self._known: dict[bool, tuple[bytes, Steps]] = {}

    @property
    def start(self) -> Float[np.ndarray, "batch state"]:
        """(B, 20 + 2 K): at rest."""
        return np.tile(start_of(self._push.squares.shape[1]), (len(self._push.squares), 1))

    def __call__(self, rows: Rows, times: Each, states: States) -> States:
        """The slopes of states (R, 20 + 2 K) at `times` (R,) in s of the pushes `rows`."""
        out = np.empty_like(states)
        for pushing in (True, False):
            some = (times < self._pulse) == pushing
            if some.any():
                now = unpacked(states[some], pushing)
                out[some] = flat_slopes(now, self._steps(rows[some], pushing).slope(now))
        return out

    def advance(self, rows: Rows, times: Each, states: States, steps: Each) -> tuple[States, States, Each]:
        """States (R, 20 + 2 K) after `steps` (R,) s, to second order, slopes there, and errors (R,) in m.

        The end of the pulse ends a step.
        """
        left = np.minimum(np.maximum(self._pulse - times, 0.0), steps)
        out = states, np.empty_like(states), np.zeros(len(rows))
        pushed = left > SHORTEST
        out = self._advanced(rows, out, pushed, True, left)
        return self._advanced(rows, out, ~pushed | (steps - left > SHORTEST), False, steps - left)

    def _advanced(
        self,
        rows: Rows,
        known: tuple[States, States, Each],
        some: Bool[np.ndarray, " rows"],
        pushing: bool,
        steps: Each,
    ) -> tuple[States, States, Each]:
        """Some of the states go on; states, slopes and errors of all."""
        if not some.any():
            return known
        states, slopes, errors = (values.copy() for values in known)
        now, step = unpacked(states[some], pushing), steps[some]
        after, error = self._steps(rows[some], pushing).advance(now, step)
        slopes[some] = flat_slopes(after, (after.velocity - now.velocity) / step[:, None])
        states[some] = packed(after, states[some])
        errors[some] += error
        return states, slopes, errors

    def _steps(self, rows: Rows, pushing: bool) -> Steps:
        """The last one is kept for each phase: what it holds is large, and the same until a motion ends."""
        key, (last, steps) = rows.tobytes(), self._known.get(pushing, (b"", None))
        if steps is None or last != key:
            whole = self._push if pushing else self._push.over
            steps = Steps(self._mechanics, whole if len(rows) == len(whole.squares) else whole.some(rows))
            self._known[pushing] = key, steps
        return steps
