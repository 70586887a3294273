"""Finds where two like bodies are in contact with each other."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.contacts import Contacts
from odeform.mechanics.inside import Inside
from odeform.mechanics.push import Push
from odeform.mechanics.rotations import skew
from odeform.mechanics.state import State
from odeform.mechanics.touching import MARGIN, axes_of
from odeform.mechanics.warping import bent
from odeform.types import Floats, Ints, Perpoint

__all__ = ["BOTH", "Meeting", "Met"]

NOTHING = np.zeros(0, dtype=np.int64)
BOTH = ((0, 1), (1, 0))  # samples of the one meet the surface of the other


@dataclass(frozen=True, eq=False)
class Met:
    """Samples of each of two bodies that may touch the other one in a step."""

    meeting: "Meeting"
    chosen: tuple[Ints, Ints]

    def contacts(self, state: State) -> Contacts:
        """Linearised about a state (2,): contacts of one motion, of the velocities of both bodies in their own axes,
        (1, C, 3, 2 V)."""
        return self.meeting.contacts(state, self.chosen)


class Meeting:
    """Where two bodies of one shape may touch each other."""

    def __init__(
        self, push: Push, inside: Inside, stiffness: Perpoint, parameters: ContactParameters, reach: float, most: int
    ) -> None:
        """`push` are both, and `stiffness` (S,) N/m that of their samples on the floor, none of which is farther than
        `reach` m from the mass centre. At most so many contacts each way are followed."""
        self._push, self._inside, self._parameters = push, inside, parameters
        self._reach, self._most = reach, most
        self._samples = np.ascontiguousarray(push.points[0].T)
        # a sample presses on another body as it does on the floor
        self.springs = np.stack([stiffness, parameters.floor_regularisation * push.masses[0]])
        self._extents = np.sqrt((push.rows[:, :3] ** 2).sum(axis=(1, 3)).max(axis=1))

    def near(self, state: State, step: float) -> Met:
        """The samples that may touch the other body in a step of so many seconds."""
        velocity = state.velocity
        spin = np.sqrt((velocity[:, 3:6] ** 2).sum(axis=1)).sum()
        speed = float(np.linalg.norm(velocity[0, :3] - velocity[1, :3]) + self._reach * spin)
        margin = MARGIN + 2.0 * step * speed  # dampers do not act before contact
        extents = self._reach + self._extents * np.sqrt((state.modes * state.modes).sum(axis=1))
        if np.linalg.norm(state.shift[0] - state.shift[1]) >= extents.sum() + margin:
            return Met(self, (NOTHING, NOTHING))
        turning, place = bent(self._push.points, self._push.rows, state)
        turns, found = turning.rotations, []
        for one, other in BOTH:
            local = self._seen(place[one], state, one, other)
            close = np.flatnonzero((local * local).sum(axis=1) < (extents[other] + margin) ** 2)
            gap = self._inside.met(local[close], self._samples, place[other].T, turns[other])[0]
            below = np.flatnonzero(gap < margin)
            if len(below) > self._most:
                below = below[np.argpartition(gap[below], self._most - 1)[: self._most]]
            found.append(close[below])
        return Met(self, (found[0], found[1]))

    @staticmethod
    def _seen(place: Floats, state: State, one: int, other: int) -> Float[np.ndarray, "samples 3"]:
        """Places (3, S) m of one body in axes of the other."""
        scene = (state.rotation[one] @ place).T + (state.shift[one] - state.shift[other])
        return scene @ state.rotation[other]

    def contacts(self, state: State, chosen: tuple[Ints, Ints]) -> Contacts:
        """As `Met.contacts`, (1, C, 3, 2 V) for samples `chosen` of both."""
        turning, place = bent(self._push.points, self._push.rows, state)
        turns, size, parts, gaps = turning.rotations, state.velocity.shape[1], [], []
        for (one, other), some in zip(BOTH, chosen, strict=True):
            local = self._seen(place[one][:, some], state, one, other)
            gap, normal, owner = self._inside.met(local, self._samples, place[other].T, turns[other])
            axes = axes_of(normal @ state.rotation[other].T)
            out = np.empty((len(some), 3, 2, size))
            self._moves(out, state, one, axes, place[one][:, some].T, turns[one, some], some)
            self._moves(out, state, other, axes, local, turns[other, owner], owner)
            out[:, :, other] *= -1.0
            parts.append(out.reshape(len(some), 3, 2 * size))
            gaps.append(gap)
        stiffness, grip = self.springs[:, np.concatenate(chosen)]
        parameters, each = self._parameters, np.ones((1, len(stiffness)))
        return Contacts(
            np.concatenate(parts)[None],
            np.concatenate(gaps)[None],
            stiffness[None],
            parameters.floor_damping * each,
            parameters.floor_friction * each,
            grip[None],
            0.0 * each,
        )

    def _moves(
        self, out: Floats, state: State, body: int, axes: Floats, arms: Floats, turns: Floats, samples: Ints
    ) -> None:
        """Sets how fast places (C, 3) m of a body move along axes (C, 3, 3) of the scene: that of its rigid motion at
        these, and that of the samples (C,) that carry them, which have turned by `turns`."""
        own = axes @ state.rotation[body]
        out[:, :, body, :3] = own
        out[:, :, body, 3:6] = own @ skew(-arms)
        rows = self._push.rows[body][:3, samples].swapaxes(0, 1)
        out[:, :, body, 6:] = own @ turns @ rows
