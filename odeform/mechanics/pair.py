"""Two like bodies that may touch each other, as one initial value problem with a flat state."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from odeform.compiling import compiles
from odeform.mechanics.contacts import Contacts
from odeform.mechanics.flat import flat_slopes, packed, unpacked
from odeform.mechanics.inside import Inside
from odeform.mechanics.meeting import Meeting, Met
from odeform.mechanics.push import Push
from odeform.mechanics.pushed_batch import CompiledBodies
from odeform.mechanics.state import State
from odeform.mechanics.step import SWEEPS, Mechanics, Steps, local_velocity, scene_velocity, solved
from odeform.mechanics.touching import Near, most_contacts
from odeform.types import Floats

__all__ = ["Pair", "PairSteps"]


@dataclass(frozen=True, eq=False, kw_only=True)
class NearBoth(Near):
    """What of two bodies may touch the floor in a step, and what the other one."""

    met: Met

    def contacts(self, state: State) -> "ContactsOfBoth":
        return ContactsOfBoth(**vars(super().contacts(state)), met=self.met.contacts(state))


@dataclass(frozen=True, eq=False, kw_only=True)
class ContactsOfBoth(Contacts):
    """Contacts of two bodies with the floor, and those with each other."""

    met: Contacts


class PairSteps(Steps):
    """Steps of two bodies, which are solved for together: what the one loses in momentum, the other one gains."""

    def __init__(self, mechanics: Mechanics, push: Push, inside: Inside) -> None:
        """`push` are both bodies."""
        super().__init__(mechanics, push, mechanics.preload(push))
        most = most_contacts(push.support)
        stiffness, reach = mechanics.floor.stiffness, mechanics.body.reach
        self.meeting = Meeting(push, inside, stiffness, mechanics.parameters, reach, most)

    def near(self, state: State, step: float | Floats) -> Near:
        """What of both may touch the floor, or the other body, in a step of `step` seconds, one or (2,)."""
        return NearBoth(**vars(super().near(state, step)), met=self.meeting.near(state, float(np.max(step))))

    def slope(self, state: State, time: float | Floats = 0.0) -> Floats:
        """Computes (2, V) accelerations."""
        local = local_velocity(state)
        met, (batch, size) = self.meeting.near(state, 0.0).contacts(state), local.shape
        rate = self.rates(state, local, time)
        rate += met.forces(local.reshape(1, -1)).reshape(batch, size)
        return scene_velocity(self.accelerations(rate), state)

    def solve(
        self, state: State, contacts: Contacts, velocity: Floats, step: Floats, masses: Floats, momentum: Floats
    ) -> Floats:
        """Velocities (H, 2, V) after each of H steps."""
        assert isinstance(contacts, ContactsOfBoth)
        met, (batch, size) = contacts.met, momentum.shape[1:]
        for _ in range(SWEEPS):
            matrix, impulse = contacts.resistance(velocity, step)
            self._add_masses(matrix, masses)
            both = velocity.reshape(len(velocity), 1, batch * size)
            joint, between = met.resistance(both, step)
            joint = joint[:, 0]
            for body in range(batch):
                some = slice(body * size, (body + 1) * size)
                joint[:, some, some] += matrix[:, body]
            right = (momentum + impulse).reshape(-1, batch * size) + between[:, 0]
            velocity = solved(joint, right).reshape(-1, batch, size)
        return velocity


class CompiledPair:
    """Steps of two bodies in machine code."""

    def __init__(self, mechanics: Mechanics, push: Push, inside: Inside, springs: Floats) -> None:
        """`push` are both bodies, and `springs` (2, S) as of `Meeting`."""
        from odeform.mechanics.compiled_pair import Between

        self._constants = CompiledBodies(mechanics, push, 0.0).constants
        self._between = Between(inside.values, inside.owners, inside.origin, inside.cell, springs[0], springs[1])

    def advance(self, time: float, states: Floats, step: float) -> tuple[Floats, Floats, float]:
        """What `Pair.advance` returns, from states (2, S)."""
        from odeform.mechanics.compiled_pair import advance_pair

        out, slopes = np.empty_like(states), np.empty_like(states)
        error = advance_pair(self._constants, self._between, time, states, step, out, slopes)
        return out.ravel(), slopes.ravel(), error


class Pair:
    """A body that is thrown and one that stands, until they rest. It is a `StiffField`.

    The state is that of the one as of `PushedBody`, and then that of the other.
    """

    def __init__(self, mechanics: Mechanics, push: Push, inside: Inside) -> None:
        """`push` are both."""
        self._mechanics, self._push, self._inside = mechanics, push, inside

    @cached_property
    def _steps(self) -> PairSteps:
        return PairSteps(self._mechanics, self._push, self._inside)

    @cached_property
    def _compiled(self) -> CompiledPair:
        return CompiledPair(self._mechanics, self._push, self._inside, self._steps.meeting.springs)

    def __call__(self, time: float, state: Floats) -> Floats:
        """Returns the slope of a state at `time` in s."""
        now = unpacked(state.reshape(2, -1), False)
        return flat_slopes(now, self._steps.slope(now, time)).ravel()

    def advance(self, time: float, state: Floats, step: float) -> tuple[Floats, Floats, float]:
        """Returns the state (2 S,) after `step` seconds, to second order, the slope there, and the error in m."""
        before = state.reshape(2, -1)
        if compiles():
            return self._compiled.advance(time, before, step)
        return self._advanced(time, before, step)

    def _advanced(self, time: float, before: Floats, step: float) -> tuple[Floats, Floats, float]:
        now = unpacked(before, False)
        after, errors = self._steps.advance(now, step, time)
        slopes = flat_slopes(after, (after.velocity - now.velocity) / step)
        return packed(after, before).ravel(), slopes.ravel(), float(errors.max())
