"""One step in time of reduced mechanics: linearly implicit, so that stiff contacts and fast modes do not limit it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.mechanics.body import ReducedBody
from odeform.mechanics.contacts import Contacts, floor_contacts, joined, push_contacts
from odeform.mechanics.floor import GRAVITY, Floor, stand
from odeform.mechanics.law import MechanicalLaw
from odeform.mechanics.push import Push
from odeform.mechanics.state import State, extrapolated
from odeform.mechanics.turns import skew, turn
from odeform.types import Floats

__all__ = ["Mechanics", "Projectile"]

AHEAD = 0.02  # s: errors of velocities count by how far they carry in that time
SWEEPS = 2  # solves of a step: contacts and friction of the second are those that the first finds


@dataclass(frozen=True)
class Projectile:
    """A rigid sphere without weight."""

    radius: float
    """m"""
    mass: float
    """kg"""


@dataclass(frozen=True, eq=False)
class Mechanics:
    """The right-hand side: a body under a law of contact and material, and what it is pushed by."""

    body: ReducedBody
    law: MechanicalLaw
    projectile: Projectile

    @cached_property
    def floor(self) -> Floor:
        """Springs of the floor."""
        return stand(self.body, self.law)

    @property
    def relaxation(self) -> float:
        """Ratio of damping to stiffness, s."""
        return self.law.damping * self.body.solid.damping

    def advance(self, state: State, push: Push, step: float) -> tuple[State, Floats]:
        """One step of second order: twice two half steps less a whole one. Also returns its error (B,) in m: how far
        the two half steps are from the whole one."""
        steps = np.repeat([[step], [0.5 * step]], len(state.shift), axis=0)
        # the whole step and the first half are one batch
        whole, half = self._implicit(state.twice(), push.twice, steps).halves()
        fine = self._implicit(half, push, steps[len(state.shift) :])
        return extrapolated(whole, fine), self._distance(whole, fine)

    def _distance(self, one: State, other: State) -> Floats:
        """(B,) about the RMS distance in m, now and with the velocities of each `AHEAD` from now."""
        turned = turn(one.rotation @ other.rotation.transpose(0, 2, 1))
        at = np.concatenate([one.shift - other.shift, turned, one.modes - other.modes], axis=1)
        speed = (one.velocity - other.velocity)[:, : one.body]
        return np.sqrt(((at * at + (AHEAD * AHEAD) * (speed * speed)) * self._squares(one.body)).sum(axis=1))

    def _squares(self, count: int) -> Floats:
        """(count,) m^2: mean square displacement of the body by a unit of each coordinate."""
        mass = self.body.solid.mass
        squares = np.full(count, 1.0 / mass)
        squares[:3], squares[3:6] = 1.0, np.diag(self.body.solid.inertia) / mass
        return squares

    def slope(self, state: State, push: Push) -> Floats:
        """(B, V) accelerations."""
        still = np.zeros((len(state.shift), 1))
        matrix, momentum = self._free(state, push, still)
        # without a step in time, momentum is that of now; one second of forces is added
        force = self._free(state, push, still + 1.0)[1] - momentum
        inner = slice(6, state.body)
        force[:, inner] -= self.relaxation * self.law.stiffness * push.squares * state.velocity[:, inner]
        contacts = self._contacts(state, push, 0.0)
        if contacts is not None:
            pushes = contacts.forces(state.velocity)
            force += np.einsum("bcin,bci->bn", contacts.jacobian, pushes)
        return np.linalg.solve(matrix, force[..., None])[..., 0]

    def _contacts(self, state: State, push: Push, step: float) -> Contacts | None:
        contacts = floor_contacts(self.body, self.floor, self.law, state, push, step)
        if not state.pushed:
            return contacts
        return joined(contacts, push_contacts(push, self.projectile.radius, self.law, state, step))

    def _implicit(self, state: State, push: Push, step: Float[np.ndarray, "batch 1"]) -> State:
        """One step of first order."""
        matrix, momentum = self._free(state, push, step)
        contacts = self._contacts(state, push, float(step.max()))
        if contacts is None:
            return state.moved(np.linalg.solve(matrix, momentum[..., None])[..., 0], step)
        velocity = state.velocity
        for _ in range(SWEEPS):
            stiff, impulse = contacts.resistance(velocity, step)
            velocity = np.linalg.solve(matrix + stiff, (momentum + impulse)[..., None])[..., 0]
        return state.moved(velocity, step)

    def _free(self, state: State, push: Push, step: Float[np.ndarray, "batch 1"]) -> tuple[Floats, Floats]:
        """Matrix (B, V, V) and momentum (B, V) of a step without contacts."""
        body, law, velocity = self.body, self.law, state.velocity
        (batch, size), count = velocity.shape, state.body
        squares = law.stiffness * push.squares
        masses = np.empty((batch, size))
        masses[:, :3] = body.solid.mass
        masses[:, 3:6] = 0.0
        masses[:, 6:count] = 1.0
        masses[:, count:] = self.projectile.mass
        inertia = state.rotation @ body.solid.inertia @ state.rotation.transpose(0, 2, 1)
        spin = velocity[:, 3:6]
        turning = (inertia @ spin[..., None])[..., 0]
        momentum = masses * velocity
        momentum[:, 2] -= step[:, 0] * (body.solid.mass * GRAVITY)
        momentum[:, 3:6] = turning - step * (skew(spin) @ turning[..., None])[..., 0]
        momentum[:, 6:count] -= step * (squares * state.modes + self.floor.preload @ push.modes)
        if state.pushed:
            momentum[:, count:] += step * push.forces
        masses[:, 6:count] += step * (step + self.relaxation) * squares
        matrix = np.zeros((batch, size, size))
        matrix[:, np.arange(size), np.arange(size)] = masses
        matrix[:, 3:6, 3:6] = inertia
        return matrix, momentum
