"""Keeps two bodies out of each other where they are shown."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from odeform.mechanics.flat import body_motion
from odeform.mechanics.inside import Inside
from odeform.mechanics.push import Push
from odeform.mechanics.state import State
from odeform.mechanics.warping import bent
from odeform.types import Floats, Times, Vector

__all__ = ["Apart"]

BOTH = ((0, 1), (1, 0))


class Apart:
    """Springs of contacts stand for what gives way there: where two bodies would be inside each other, both lie on what
    is halfway between their surfaces."""

    def __init__(self, inside: Inside, push: Push, anchor: Vector, states: Callable[[Times], Floats]) -> None:
        """`push` are both bodies, whose mass centre rests at `anchor` (3,) m, and `states` maps (T,) s to their flat
        states (T, 2 S)."""
        self._inside, self._push, self._anchor, self._states = inside, push, anchor, states
        self._samples = np.ascontiguousarray(push.points[0].T)

    def __call__(self, times: Times, points: Float[np.ndarray, "times 2 points 3"]) -> None:
        """Move those of the points of both bodies, m at (T,) s, that are inside the other one."""
        shift, rotation, modes = body_motion(self._states(times).reshape(2 * len(times), -1))
        none = np.zeros((2, 0))
        for index, frame in enumerate(points):
            both = slice(2 * index, 2 * index + 2)
            self._keep(State(shift[both] + self._anchor, rotation[both], modes[both], none, none), frame)

    def _keep(self, state: State, frame: Float[np.ndarray, "2 points 3"]) -> None:
        turning, place = bent(self._push.points, self._push.rows, state)
        reach = np.sqrt((place * place).sum(axis=1).max(axis=1))
        if np.linalg.norm(state.shift[0] - state.shift[1]) > reach.sum():
            return
        turns, moves = turning.rotations, []
        for one, other in BOTH:
            local = (frame[one] - state.shift[other]) @ state.rotation[other]
            close = np.flatnonzero((local * local).sum(axis=1) < reach[other] ** 2)
            gap, normal, _ = self._inside.met(local[close], self._samples, place[other].T, turns[other])
            inside = gap < 0.0
            moves.append((close[inside], (0.5 * gap[:, None] * normal)[inside] @ state.rotation[other].T))
        for points, (some, move) in zip(frame, moves, strict=True):
            points[some] -= move.astype(points.dtype)
