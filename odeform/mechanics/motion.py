"""A pushed body over time: steps of a fixed length from rest, and what lies between them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.mechanics.push import Push
from odeform.mechanics.state import State
from odeform.mechanics.step import Mechanics, Steps
from odeform.types import Floats

__all__ = ["Nodes", "push_body"]


@dataclass(frozen=True, eq=False)
class Nodes:
    """States of B motions at `times` (T,) s."""

    times: Floats
    states: list[State]

    @property
    def shifts(self) -> Float[np.ndarray, "batch times 3"]:
        """m."""
        return np.stack([state.shift for state in self.states], axis=1)

    @property
    def rotations(self) -> Float[np.ndarray, "batch times 3 3"]:
        """From rest."""
        return np.stack([state.rotation for state in self.states], axis=1)

    @property
    def amplitudes(self) -> Float[np.ndarray, "batch times directions"]:
        """Of the directions of deformation, root kg m."""
        return np.stack([state.modes for state in self.states], axis=1)


def push_body(mechanics: Mechanics, push: Push, pulse: float, until: float, step: float) -> Nodes:
    """Bodies at rest that are pushed for `pulse` seconds; at least to `until` seconds. The pulse is divided into whole
    steps of about `step` seconds."""
    batch, size = push.squares.shape
    count = max(round(pulse / step), 1)
    step = pulse / count
    turns = np.broadcast_to(np.eye(3), (batch, 3, 3))
    rest = (np.zeros((batch, n)) for n in (size, 1, 7 + size))
    states, steps = [State(np.zeros((batch, 3)), turns, *rest)], Steps(mechanics, push)
    for index in range(max(int(np.ceil(until / step - 1e-9)), 1)):
        if index == count:
            states[-1] = states[-1].without_projectile()
        states.append(steps.advance(states[-1], step)[0])
    return Nodes(step * np.arange(len(states)), states)
