"""Keeps two bodies out of each other where they are shown."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from odeform.mechanics.flat import body_motion
from odeform.mechanics.inside import Inside
from odeform.mechanics.push import Push
from odeform.mechanics.state import State
from odeform.mechanics.warping import bent
from odeform.types import Floats, Ints, Times, Vector

__all__ = ["Apart"]

BOTH = ((0, 1), (1, 0))
SHARES = (0.5, 0.5, 0.5, 0.5, 1.0)
"""Of the depth that is left by which points of both are moved, one time after the other: where only the one gives way,
as a nose that sinks into a flank does, it takes more than its half."""


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
        none = np.zeros((2, 1))
        for index, frame in enumerate(points):
            both = slice(2 * index, 2 * index + 2)
            self._keep(State(shift[both] + self._anchor, rotation[both], modes[both], none, none), frame)

    def _keep(self, state: State, frame: Float[np.ndarray, "2 points 3"]) -> None:
        turning, place = bent(self._push.points, self._push.rows, state)
        reach = np.sqrt((place * place).sum(axis=1).max(axis=1))
        if np.linalg.norm(state.shift[0] - state.shift[1]) > reach.sum():
            return
        turns, samples = turning.rotations, (state.rotation @ place).swapaxes(1, 2) + state.shift[:, None]
        # samples of each surface go along, so that it is known where it has been moved to
        points = np.concatenate([frame, samples], axis=1)
        chosen = [self._close(points[one], state, other, reach[other]) for one, other in BOTH]
        for share in SHARES:
            moved, moves = points[:, frame.shape[1] :] - samples, []
            for (one, other), some in zip(BOTH, chosen, strict=True):
                local = (points[one, some] - state.shift[other]) @ state.rotation[other]
                gap, normal, owner = self._inside.met(local, self._samples, place[other].T, turns[other])
                normal = normal @ state.rotation[other].T
                gap = np.minimum(gap - (moved[other, owner] * normal).sum(axis=1), 0.0)
                moves.append(share * gap[:, None] * normal)
            for each, some, move in zip(points, chosen, moves, strict=True):
                each[some] -= move
            # what is outside of the other one stays so, as that only gives way
            chosen = [some[move.any(axis=1)] for some, move in zip(chosen, moves, strict=True)]
        frame[:] = points[:, : frame.shape[1]]

    @staticmethod
    def _close(points: Floats, state: State, other: int, reach: float) -> Ints:
        away = points - state.shift[other]
        return np.flatnonzero((away * away).sum(axis=1) < reach**2)
