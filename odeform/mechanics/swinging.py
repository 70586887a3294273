"""A clamped body in few directions, exactly as nonlinear as its material: its energy is a polynomial of degree four."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import lu_factor, lu_solve
from threadpoolctl import threadpool_limits

from odeform.errors import InputError
from odeform.mechanics.clamped import ClampedBody
from odeform.types import Floats, Ints, Times

__all__ = ["Loss", "Swing", "SwingingBody", "swinging_body"]

CHUNK = 64  # elements whose strains are held at once
TOLERANCE, MOST_STEPS = 1e-9, 40  # of Newton's method in one step in time: relative change, and iterations
RENEWED = (5, 9, *range(12, MOST_STEPS))  # iterations whose matrix is made anew


@dataclass(frozen=True)
class Loss:
    """How a material loses energy; both parts act on strains, so that turning costs nothing."""

    viscous: float = 0.0
    """s: stress by the rate of strain, relative to the stiffness (Kelvin and Voigt)."""
    lag: float = 0.0
    """Stiffness that comes on top of the static one in fast motion, relative to it (standard linear solid)."""
    time: float = 0.02
    """s in which it relaxes."""

    def __post_init__(self) -> None:
        if not (self.viscous >= 0.0 and self.lag >= 0.0 and self.time > 0.0):
            raise InputError(f"damping: expected numbers of at least 0 and a positive time, got {self}")


@dataclass(frozen=True, eq=False)
class Swing:
    """A motion of a `SwingingBody`."""

    times: Times
    """(T,) s, evenly spaced from 0 on."""
    amplitudes: Float[np.ndarray, "times directions"]
    """(T, R) root kg m."""
    energy: Float[np.ndarray, " times"]
    """(T,) J: kinetic, elastic and of the load."""


@dataclass(frozen=True, eq=False)
class SwingingBody:
    """R amplitudes q with unit masses. The strain at any point is linear in the products p = (q, q_i q_j), so that the
    elastic energy is p H p / 2 (Barbic and James 2005, ACM Transactions on Graphics 24)."""

    products: Float[np.ndarray, "products products"]
    """H, N/m and so on, for the Young's modulus of the body that it was made of."""
    load: Float[np.ndarray, " directions"]
    """(R,) the load on each amplitude."""
    stiffer: float = 1.0
    """By which H is multiplied: stiffness is proportional to Young's modulus."""

    @property
    def size(self) -> int:
        """R."""
        return len(self.load)

    @cached_property
    def pairs(self) -> Int[np.ndarray, "pairs 2"]:
        """Which two amplitudes each product of two is of."""
        return np.stack(np.triu_indices(self.size), axis=1)

    def times_as_stiff(self, factor: float) -> "SwingingBody":
        """Returns the same body of so many times its Young's modulus."""
        return replace(self, stiffer=factor * self.stiffer)

    def terms(self, q: Floats) -> tuple[Floats, Floats]:
        """Computes p (P,) and its derivative (P, R) at amplitudes (R,)."""
        first, second = self.pairs.T
        slopes = np.zeros((self.size + len(first), self.size))
        slopes[range(self.size), range(self.size)] = 1.0
        rows = np.arange(self.size, len(slopes))
        slopes[rows, first] += q[second]
        slopes[rows, second] += q[first]
        return np.concatenate([q, q[first] * q[second]]), slopes

    def curved(self, stress: Floats) -> Floats:
        """Computes (R, R) the derivative of slopes^T stress by q at constant stress (P,)."""
        found = np.zeros((self.size, self.size))
        first, second = self.pairs.T
        np.add.at(found, (first, second), stress[self.size :])
        np.add.at(found, (second, first), stress[self.size :])
        return found

    def energy(self, q: Floats) -> float:
        """J, elastic and of the load, at amplitudes (R,)."""
        terms = self.terms(q)[0]
        return float(0.5 * self.stiffer * terms @ self.products @ terms - self.load @ q)

    def hanging(self, factor: float = 1.0) -> tuple[Floats, Floats]:
        """(R,) amplitudes where it hangs still under `factor` times its load, and their derivative by the factor.
        `InputError` where it collapses."""
        q, load = np.zeros(self.size), factor * self.load
        for _ in range(MOST_STEPS):
            terms, slopes = self.terms(q)
            stress = self.stiffer * (self.products @ terms)
            slope = self.stiffer * (slopes.T @ (self.products @ slopes)) + self.curved(stress)
            change = np.linalg.solve(slope, load - slopes.T @ stress)
            q = q + change
            if np.abs(change).max() <= TOLERANCE * (np.abs(q).max() + TOLERANCE):
                return q, np.linalg.solve(slope, self.load)
        raise InputError("the clamped body finds no equilibrium under its load: it is too soft for it")

    def release(self, until: float, step: float, loss: Loss) -> Swing:
        """Let go at rest and without stress at time 0, and follow it to `until` s."""
        return self.follow(np.zeros(self.size), np.zeros(self.size), until, step, loss)

    def follow(self, q: Floats, speed: Floats, until: float, step: float, loss: Loss, aged: float = 0.0) -> Swing:
        """The motion from amplitudes and speeds (R,) at time 0 to `until` s, by implicit midpoint steps of `step` s,
        which are of second order and keep the energy of a linear body. It began without stress `aged` seconds before,
        and deformed steadily since. `InputError` where a step is not solved."""
        count = round(until / step)
        if count < 1:
            raise InputError(f"expected a time of at least one step of {step:g} s, got {until:g} s")
        ratio = loss.time / aged if aged > 0.0 else np.inf
        relaxed = 0.0 if aged <= 0.0 else 1.0 - ratio * -np.expm1(-1.0 / ratio)
        state = _State(q, speed, relaxed * self.terms(q)[0])
        stepper, found, energy = _Stepper(self, step, loss), [q], [self._total(state)]
        with threadpool_limits(1):  # products are too small to share
            for _ in range(count):
                state = stepper.after(state)
                found.append(state.q)
                energy.append(self._total(state))
        return Swing(step * np.arange(count + 1), np.stack(found), np.array(energy))

    def _total(self, state: "_State") -> float:
        return 0.5 * float(state.speed @ state.speed) + self.energy(state.q)


class _State(NamedTuple):
    q: Floats
    speed: Floats
    lagging: Floats
    """(P,) products that the stress has forgotten: they follow the others with the time of relaxation."""


class _Stepper:
    """Steps in time by Newton's method, whose matrix is kept while it serves."""

    def __init__(self, body: SwingingBody, step: float, loss: Loss) -> None:
        self._body, self._step, self._loss = body, step, loss
        self._half = 0.5 * step / loss.time
        self._lag = loss.lag / (1.0 + self._half)
        self._matrix: tuple[Floats, Ints] | None = None

    def after(self, state: _State) -> _State:
        """One step: forces are those in its middle, of the strains' rates there and of what is forgotten by then."""
        step, guess = self._step, state.q + self._step * state.speed
        for attempt in range(MOST_STEPS):
            wrong, terms = self._wrong(state, guess, fresh=self._matrix is None or attempt in RENEWED)
            change = lu_solve(self._matrix, wrong, check_finite=False)
            guess = guess - change
            if np.abs(change).max() <= TOLERANCE * (np.abs(guess).max() + TOLERANCE):
                forgotten = 2.0 * (state.lagging + self._half * terms) / (1.0 + self._half) - state.lagging
                return _State(guess, 2.0 * (guess - state.q) / step - state.speed, forgotten)
        raise InputError(f"a step of {step:g} s finds no end: the body is too soft for its load, or the step too long")

    def _wrong(self, state: _State, guess: Floats, fresh: bool) -> tuple[Floats, Floats]:
        """(R,) what the balance of forces misses if the step ends at a guess, and (P,) the middle's products."""
        body, step, viscous = self._body, self._step, self._loss.viscous
        rate = (guess - state.q) / step
        terms, slopes = body.terms(0.5 * (state.q + guess))
        strain = (1.0 + self._lag) * terms - self._lag * state.lagging + viscous * (slopes @ rate)
        stress = body.stiffer * (body.products @ strain)
        if fresh:
            # derivatives by the guess, half as fast as which the middle moves
            inner = (0.5 * (1.0 + self._lag) + viscous / step) * slopes
            inner[body.size :] += 0.5 * viscous * body.terms(rate)[1][body.size :]
            slope = body.stiffer * (slopes.T @ (body.products @ inner)) + 0.5 * body.curved(stress)
            slope[range(body.size), range(body.size)] += 2.0 / step**2
            self._matrix = lu_factor(slope, check_finite=False)
        return 2.0 * (rate - state.speed) / step + slopes.T @ stress - body.load, terms


def swinging_body(body: ClampedBody, directions: Float[np.ndarray, "directions nodes 3"]) -> SwingingBody:
    """Sums the energy of a body that deforms in orthonormal `directions` (R, N, 3) only."""
    mesh, (first, shear) = body.mesh, body.stiffness.lame
    size = len(directions)
    one, two = np.triu_indices(size)
    found = np.zeros((size + len(one), size + len(one)))
    for begin in range(0, len(mesh.elements), CHUNK):
        part = slice(begin, begin + CHUNK)
        moved = directions[:, mesh.elements[part]]
        gradient = np.einsum("rmai,mgad->rmgid", moved, mesh.slopes[part], optimize=True)
        linear = 0.5 * (gradient + gradient.swapaxes(-1, -2))
        square = gradient[one].swapaxes(-1, -2) @ gradient[two]
        square = 0.5 * (square + square.swapaxes(-1, -2)) * np.where(one == two, 0.5, 1.0)[:, None, None, None, None]
        strains = np.concatenate([linear, square])
        volume = mesh.volumes[part]
        flat = (strains * np.sqrt(0.25 * volume)[:, None, None, None]).reshape(len(strains), -1)
        found += 2.0 * shear * (flat @ flat.T)
        swelling = np.trace(strains, axis1=3, axis2=4).mean(axis=2) * np.sqrt(volume)
        found += first * (swelling @ swelling.T)
    return SwingingBody(found, np.einsum("rni,ni->r", directions, body.load))
