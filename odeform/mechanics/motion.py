"""A pushed body over time: steps of a fixed length from rest, and what lies between them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.mechanics.flat import unpacked
from odeform.mechanics.push import Push
from odeform.mechanics.pushed_batch import pushed_bodies
from odeform.mechanics.state import State
from odeform.mechanics.step import Mechanics

__all__ = ["Nodes", "push_body"]


@dataclass(frozen=True, eq=False)
class Nodes:
    """Holds the states of B motions at T times, a step apart."""

    states: list[State]

    @property
    def shifts(self) -> Float[np.ndarray, "batch times 3"]:
        """Shifts of the mass centre, m."""
        return np.stack([state.shift for state in self.states], axis=1)

    @property
    def rotations(self) -> Float[np.ndarray, "batch times 3 3"]:
        """Starts from rest."""
        return np.stack([state.rotation for state in self.states], axis=1)

    @property
    def amplitudes(self) -> Float[np.ndarray, "batch times directions"]:
        """Amplitudes of the directions of deformation, root kg m."""
        return np.stack([state.modes for state in self.states], axis=1)


def push_body(mechanics: Mechanics, push: Push, pulse: float, until: float, step: float) -> Nodes:
    """Bodies at rest that are pushed for `pulse` seconds; at least to `until` seconds. The pulse is divided into whole
    steps of about `step` seconds."""
    count = max(round(pulse / step), 1)
    step = pulse / count
    bodies = pushed_bodies(mechanics, push, pulse)
    flat, rows = bodies.start, np.arange(len(push.eigenvalues))
    states, steps = [unpacked(flat, True)], np.full(len(rows), step)
    for index in range(max(int(np.ceil(until / step - 1e-9)), 1)):
        flat = bodies.advance(rows, index * steps, flat, steps)[0]
        states.append(unpacked(flat, index + 1 < count))
    return Nodes(states)
