"""One step in time of reduced mechanics: linearly implicit, so that stiff contacts and fast modes do not limit it.

It is solved for in axes of the bodies, in which their inertia is constant.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.linalg import get_lapack_funcs

from odeform.loads.situation import pulse_strength
from odeform.mechanics.body import ReducedBody
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.contacts import Contacts
from odeform.mechanics.flat import parts_of, start_of, unpacked
from odeform.mechanics.floor import GRAVITY, Floor, stand
from odeform.mechanics.push import Push
from odeform.mechanics.rotations import skew
from odeform.mechanics.state import State, apart, extrapolated
from odeform.mechanics.touching import Near, Touching
from odeform.mechanics.warping import bent
from odeform.types import Floats

__all__ = ["SWEEPS", "Mechanics", "Projectile", "Rest", "Steps", "local_velocity", "scene_velocity", "solved"]

AHEAD = 0.02  # s: errors of velocities count by how far they carry in that time
(SOLVE,) = get_lapack_funcs(("posv",), dtype=np.float64)
SWEEPS = 2  # solves of a step: contacts and friction of the second are those that the first finds


@dataclass(frozen=True)
class Projectile:
    """A rigid sphere without weight."""

    radius: float
    """m"""
    mass: float
    """kg"""


@dataclass(frozen=True, eq=False)
class Rest:
    """Coordinates of a body that does not rest at zero, as in `State`."""

    shift: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    modes: Float[np.ndarray, " soft"]
    """Amplitudes of the first directions of every push, which are the body's softest modes."""


@dataclass(frozen=True, eq=False)
class Mechanics:
    """A body under contact parameters, and what it is pushed by."""

    body: ReducedBody
    parameters: ContactParameters
    projectile: Projectile
    stress: float = 1.0
    """Fraction of the floor's force on the body in zero of its coordinates that its stress there balances: one where it
    rests there."""
    rest: Rest | None = None
    """None where it rests in zero."""
    free: Float[np.ndarray, " modes"] | None = None
    """Amplitudes of the body's modes without stress; None where its stress is what balances the floor."""
    lands: bool = False
    """Whether it may fall on any side, at any speed: the floor is level for all of them, and its dampers do not act
    before contact."""

    @cached_property
    def floor(self) -> Floor:
        """Springs of the floor."""
        floor = stand(self.body, self.parameters)
        return floor.under_any_side(self.body.solid.height) if self.lands else floor

    @property
    def relaxation(self) -> float:
        """Ratio of damping to stiffness, s."""
        return self.parameters.damping * self.body.solid.damping

    def start(self, push: Push) -> Float[np.ndarray, "batch state"]:
        """(B, 20 + 2 K): flat states at rest."""
        size = push.eigenvalues.shape[1]
        state = start_of(size)
        if self.rest is not None:
            shift, turn, modes, *_ = parts_of(state[None])
            state[shift], state[turn] = self.rest.shift, self.rest.rotation.ravel()
            state[modes][: len(self.rest.modes)] = self.rest.modes
        return np.tile(state, (len(push.eigenvalues), 1))

    def preload(self, push: Push) -> Float[np.ndarray, "batch directions"]:
        """(B, K): what the body's own stress does to its directions of deformation in zero. Where it rests elsewhere,
        it is what keeps each of them there: stiff directions, in which the rest is not known, do not begin to ring."""
        if self.free is not None:
            return -(self.parameters.stiffness * self.body.eigenvalues * self.free) @ push.modes
        if self.rest is None:
            return self.stress * self.floor.preload @ push.modes
        steps = Steps(self, push, np.zeros_like(push.eigenvalues))
        return steps.slope(unpacked(self.start(push), False))[:, 6:]


class Steps:
    """The right-hand side for B pushes, and steps in time."""

    def __init__(self, mechanics: Mechanics, push: Push, preload: Floats) -> None:
        """Computes what all steps need; `preload` (B, K) as of `Mechanics`."""
        parameters, solid = mechanics.parameters, mechanics.body.solid
        batch, size = push.eigenvalues.shape
        self._solid, self._relaxation, self._forces = solid, mechanics.relaxation, push.forces
        self._patch, self._hold = push.patch, push.hold
        self._eigenvalues, self._preload = parameters.stiffness * push.eigenvalues, preload
        self._masses = np.concatenate([np.full(3, solid.mass), np.zeros(3), np.ones(size), [mechanics.projectile.mass]])
        self._stiffness = np.zeros((batch, len(self._masses)))
        self._stiffness[:, 6:-1] = self._eigenvalues
        # mean square displacement of the body by a unit of each coordinate, m^2
        self._spread = np.full(6 + size, 1.0 / solid.mass)
        self._spread[:3], self._spread[3:6] = 1.0, np.diag(solid.inertia) / solid.mass
        self._touching = {
            pushed: Touching(
                push if pushed else push.over,
                mechanics.floor,
                parameters,
                mechanics.projectile.radius,
                mechanics.body.reach,
                mechanics.lands,
            )
            for pushed in (True, False)
        }

    def advance(self, state: State, step: float | Floats, time: float | Floats = 0.0) -> tuple[State, Floats]:
        """One step of second order from `time` s on, of `step` seconds, or of (B,) for each motion its own: twice two
        half steps less a whole one. Also returns its error (B,) in m: how far the two half steps are from the whole
        one."""
        # the whole step and the first half begin with the same contacts
        near, middle = self.near(state, step), time + 0.5 * np.asarray(step)
        begun = self._implicit(state, near, np.array([step, 0.5 * step]), np.array([time + np.asarray(step), middle]))
        end = np.array([time + np.asarray(step)])
        whole, fine = begun.after(0), self._implicit(begun.after(1), near, np.array([0.5 * step]), end).after(0)
        between = apart(fine, whole)
        return extrapolated(whole, fine, between), self._size(between, fine.velocity - whole.velocity)

    def near(self, state: State, step: float | Floats) -> Near:
        """What may touch something in a step of `step` seconds, one or (B,)."""
        return self._touching[state.pushed].near(state, step)

    def _size(self, between: Floats, speed: Floats) -> Floats:
        """(B,) about the RMS distance in m, now and with the velocities of each `AHEAD` from now."""
        ahead = AHEAD * speed[:, : between.shape[1]]
        return np.sqrt((between * between + ahead * ahead) @ self._spread)

    def slope(self, state: State, time: float | Floats = 0.0) -> Floats:
        """Computes (B, V) accelerations at `time` s, one or (B,)."""
        local = local_velocity(state)
        return scene_velocity(self.accelerations(self.rates(state, local, time)), state)

    def rates(self, state: State, local: Floats, time: float | Floats = 0.0) -> Floats:
        """Computes (B, V) rates of the momentum, with velocities `local` (B, V), both in axes of the bodies."""
        inner = slice(6, state.body)
        _, rate = self._free(state, local)
        rate[:, inner] -= self._relaxation * self._eigenvalues * local[:, inner]
        rate += self._touching[state.pushed].near(state, 0.0).contacts(state).forces(local)
        rate += self._patched(state, np.asarray(time)[None])[0]
        if self._hold is not None:
            rate += self._hold.at(state).forces(local)
        return rate

    def accelerations(self, rate: Floats) -> Floats:
        """(B, V) of rates of the momentum, in axes of the bodies."""
        matrix = np.zeros((*rate.shape, rate.shape[1]))
        self._add_masses(matrix, self._masses[: rate.shape[1]])
        return solved(matrix, rate)

    def _implicit(self, state: State, near: Near, steps: Floats, ends: Floats) -> State:
        """The states (H, B) after one step of first order of each of H lengths in s, which end at `ends`, both (H,) or
        (H, B)."""
        velocity, step = local_velocity(state), steps.reshape(len(steps), -1, 1)
        momentum, rate = self._free(state, velocity)
        momentum, size = momentum + step * (rate + self._patched(state, ends)), velocity.shape[1]
        masses = self._masses[:size] + step * (step + self._relaxation) * self._stiffness[:, :size]
        velocity = self.solve(state, near.contacts(state), velocity[None], step, masses, momentum)
        return state.moved(scene_velocity(velocity, state), step)

    def solve(
        self, state: State, contacts: Contacts, velocity: Floats, step: Floats, masses: Floats, momentum: Floats
    ) -> Floats:
        """Velocities (H, B, V) after each of H steps, in axes of the bodies."""
        springs = None if self._hold is None else self._hold.at(state).resistance(step)
        for _ in range(SWEEPS):
            matrix, impulse = contacts.resistance(velocity, step)
            if springs is not None:
                matrix, impulse = matrix + springs[0], impulse + springs[1]
            self._add_masses(matrix, masses)
            velocity = solved(matrix, momentum + impulse)
        return velocity

    def _free(self, state: State, velocity: Floats) -> tuple[Floats, Floats]:
        """Momentum (B, V) and its rate without contacts and damping, in axes of the bodies."""
        spin = velocity[:, 3:6]
        turning = spin @ self._solid.inertia
        momentum = self._masses[: velocity.shape[1]] * velocity
        momentum[:, 3:6] = turning
        rate = np.empty_like(velocity)
        rate[:, :3] = -self._solid.mass * GRAVITY * state.rotation[:, 2]
        rate[:, 3:6] = (turning[:, None] @ skew(spin))[:, 0]
        rate[:, 6 : state.body] = -self._eigenvalues * state.modes - self._preload
        rate[:, state.body :] = self._forces[:, : int(state.pushed)]
        return momentum, rate

    def _patched(self, state: State, times: Floats) -> Floats:
        """(H, B, V) what the force on the patch adds to the rate of the momentum of a state at each of H times in s,
        (H,) or (H, B), in axes of the bodies."""
        patch, out = self._patch, np.zeros((len(times), *state.velocity.shape))
        if patch is None:
            return out
        turning, place = bent(patch.points[:, :, None], patch.rows[:, :, None], state)
        force = (patch.forces[:, None] @ state.rotation)[:, 0]
        local = (force[:, None] @ turning.rotations[:, 0])[:, 0]
        strength = pulse_strength(times, patch.duration).reshape(len(times), -1, 1)
        out[..., :3] = strength * force
        out[..., 3:6] = strength * np.cross(place[..., 0], force)
        out[..., 6 : state.body] = strength * (local[:, None] @ patch.rows[:, :3])[:, 0]
        return out

    def _add_masses(self, matrix: Floats, masses: Floats) -> None:
        """To matrices (..., V, V): masses (..., V), and inertia."""
        size = matrix.shape[-1]
        matrix.reshape(*matrix.shape[:-2], -1)[..., :: size + 1] += masses
        matrix[..., 3:6, 3:6] += self._solid.inertia


def local_velocity(state: State) -> Floats:
    """(B, V) velocities of a state in axes of the bodies."""
    return _turned(state.velocity, state.rotation)


def scene_velocity(velocity: Floats, state: State) -> Floats:
    """(..., B, V) in axes of the scene, from those in axes of the bodies."""
    return _turned(velocity, state.rotation.swapaxes(-1, -2))


def _turned(velocity: Floats, rotation: Floats) -> Floats:
    """Velocities (..., V) of which shift and spin are turned by the inverse of rotations (..., 3, 3)."""
    out = velocity.copy()
    parts = velocity[..., :6].reshape(*velocity.shape[:-1], 2, 3) @ rotation
    out[..., :6] = parts.reshape(*velocity.shape[:-1], 6)
    return out


def solved(matrices: Floats, right: Floats) -> Floats:
    """(..., V) solutions for symmetric positive matrices (..., V, V), which are overwritten; NaN where one is not.

    These are too small for `numpy.linalg.solve`: its checks take longer than the factors.
    """
    out, size = np.empty_like(right), right.shape[-1]
    for matrix, known, found in zip(
        matrices.reshape(-1, size, size), right.reshape(-1, size), out.reshape(-1, size), strict=True
    ):
        _, found[:], failed = SOLVE(matrix.T, known, overwrite_a=True)
        if failed:
            found[:] = np.nan
    return out
