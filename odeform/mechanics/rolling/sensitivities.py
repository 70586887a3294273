"""How roll-outs of a rolling body change with each number of the contact parameters: forward sensitivities.

With the state x, the contact parameters p and the field f of `dynamics.py`, S = dx/dp follows dS/dt = (df/dx) S + df/dp
(Hairer, Norsett and Wanner 1993, I.14). S is that of the discrete motion: each midpoint step is differentiated.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from odeform.mechanics.rolling.contact import ADJUSTED, COEFFICIENTS, INPUTS, PLAIN, REACHING, material_terms
from odeform.mechanics.rolling.dynamics import (
    AHEAD,
    CORNER_WEIGHTS,
    DEEP,
    DEPTHS,
    EXPONENTS,
    MOVING,
    POWERS,
    SPIN,
    UPWARD,
    Contacts,
    RollingDynamics,
    limited,
)
from odeform.types import Floats, Ints

__all__ = ["roll_out_with_sensitivities"]

NAMES = [*COEFFICIENTS, *PLAIN]  # in the order of the terms
Single = np.float32  # of sensitivities: they are many, and a step of a fit needs few digits


class _Linear(NamedTuple):
    """The accelerations (3,) of contacts (C,), linearised."""

    rows: Ints
    by_state: Float[np.ndarray, "contacts 3 5"]
    """By height, angle, speed, rising and spin."""
    by_number: Float[np.ndarray, "contacts 3 free"]


def roll_out_with_sensitivities(
    dynamics: RollingDynamics,
    free: Ints,
    start: Float[np.ndarray, "states motions"],
    steps: int,
    count: int,
    step: float,
) -> tuple[Floats, Float[np.ndarray, "times motions 3 free"]]:
    """`dynamics.roll_out` from states (8, M) that do not depend on them: states (T, 8, M), and how the positions in
    them change with the contact parameters of the indices `free` (F,), (T, M, 3, F)."""
    state = start
    out = np.empty((count + 1, *state.shape))
    found = np.zeros((count + 1, state.shape[1], MOVING, len(free)), dtype=Single)
    changes = np.zeros((state.shape[1], 2 * MOVING, len(free)), dtype=Single)
    out[0] = state
    for frame in range(1, count + 1):
        for _ in range(steps):
            slopes, contacts = dynamics.with_contacts(state)
            half = changes.copy()
            _advance(half, changes, _linearised(dynamics, contacts, free), 0.5 * step)
            middle = state + 0.5 * step * slopes
            slopes, contacts = dynamics.with_contacts(middle)
            _advance(changes, half, _linearised(dynamics, contacts, free), step)
            state = state + step * slopes
            limited(state)
        out[frame], found[frame] = state, changes[:, :MOVING]
    return out, found


def _advance(changes: Floats, here: Floats, linear: _Linear, step: float) -> None:
    """Adds to `changes` (M, 6, F), in place, `step` seconds of their slopes where the sensitivities are `here`."""
    rows = linear.rows
    pushed = linear.by_state @ here[rows, 1 : 2 * MOVING] + linear.by_number
    changes[:, :MOVING] += Single(step) * here[:, MOVING:]
    changes[rows, MOVING:] += Single(step) * pushed


def _directly(dynamics: RollingDynamics, at: Contacts) -> dict[str, Floats]:
    """How the accelerations ahead, up and turning change, (3, C) each, with what acts on them without the network: the
    depth, the speed up and of sliding, the spin, the slope of the settled place, and the coefficients by name."""
    rows, (_, up, spin) = at.rows, at.moving
    _, damping, friction, rolling, regularisation, felt = at.strong.T
    lever, inertia, power = dynamics.lever[rows], dynamics.inertia[rows], dynamics.power[rows]
    faster, logs = dynamics.damping_power[rows], np.log(at.depth)
    levers = at.brake + felt * at.corner_slopes + at.settled_slopes
    braked = -1.0 * (at.damped > 0.0) * at.spring * damping * at.depth**faster  # the push's derivative by the speed up
    slip = -friction * at.push * (1.0 - at.mobilised**2) / regularisation
    nothing = np.zeros(len(rows))

    def of(push: Floats, drag: Floats | float = 0.0, torque: Floats | float = 0.0) -> Floats:
        """(3, C) from the derivatives of the push, and what else the drag and the torque depend on."""
        ahead = drag - friction * at.mobilised * push
        return np.stack([ahead, push, (torque - lever * ahead - levers * push) / inertia])

    log_power = dynamics.logs["power"][rows]
    steeper = power * logs * ((log_power > POWERS[0]) & (log_power < POWERS[1]))
    return {
        "depth": of((power * at.push + braked * faster * up) / at.depth),
        "up": of(braked),
        "sliding": of(nothing, slip),
        "spin": of(nothing, torque=-at.push * rolling * (1.0 - np.tanh(spin / SPIN) ** 2) / SPIN),
        "slope": of(nothing, torque=-at.push),
        "stiffness": of(at.push),
        "power": of(at.push * steeper),
        "damping": of(braked * up),
        "damping_power": of(braked * up * logs * faster * (1.0 - faster)),
        "friction": of(nothing, at.drag),
        "regularisation": of(nothing, -slip * at.sliding),
        "rolling": of(nothing, torque=-at.push * at.brake),
        "inertia": np.stack([nothing, nothing, -at.turn]),
        "corners": of(nothing, torque=-at.push * felt * at.corner_slopes),
        "radius": 0.1 * dynamics.radius * of(nothing, torque=-at.drag),
    }


def _linearised(dynamics: RollingDynamics, at: Contacts, free: Ints) -> _Linear:
    """The accelerations by the state and by the contact parameters, by the chain rule."""
    rows, contact, by = at.rows, dynamics.contact, _directly(dynamics, at)
    fast, _, spin = at.moving
    inside = (at.exponents > EXPONENTS[0]) & (at.exponents < EXPONENTS[1])
    adjusted = np.stack([by[name] for name in ADJUSTED], axis=2) * inside

    # through the network: of its inputs, and of its weights
    behind = (adjusted @ contact.last.T) * (1.0 - at.hidden**2)
    by_input = behind @ contact.first[:INPUTS].T / np.array([DEEP, UPWARD, 1.0, AHEAD])
    by_sliding = by["sliding"] + by_input[..., 2] * np.sign(at.sliding)

    deep = (at.depth > DEPTHS[0]) & (at.depth < DEPTHS[1])
    by_gap, weight = 100.0 * deep * (by["depth"] + by_input[..., 0]), dynamics.corner_weight[rows]
    settled = at.reached * dynamics.settled[rows]
    felt = at.strong[:, ADJUSTED.index("corners")]
    bent = felt * dynamics.support.bends(at.angle) + ((at.apart**2 - 1.0) * settled).sum(axis=1) / REACHING**2
    by_state = [
        -by_gap,
        by_gap * (at.settled_slopes + weight * at.corner_slopes) + by["slope"] * bent,
        by_sliding + by_input[..., 3] * np.sign(fast),
        by["up"] + by_input[..., 1],
        by["spin"] - dynamics.lever[rows] * by_sliding,
    ]

    log_weight = dynamics.logs["corners"][rows]
    higher = weight * at.corners * ((log_weight > CORNER_WEIGHTS[0]) & (log_weight < CORNER_WEIGHTS[1]))
    by |= dict(zip(ADJUSTED, np.moveaxis(adjusted, 2, 0), strict=True))
    by |= {"corners": by["corners"] + by_gap * higher, "height": 1e-3 * by_gap}
    by["radius"] = by["radius"] - 0.1 * dynamics.radius * spin * by_sliding

    material = dynamics.material[rows]
    linear = np.concatenate([np.ones((len(rows), 1)), material], axis=1)
    places = 1e-3 * (by_gap[..., None] * at.reached - by["slope"][..., None] * at.apart * at.reached / REACHING)
    parts = [
        _products(np.stack([by[name] for name in NAMES], axis=2), material_terms(material)),
        _products(places, linear),
        _products(np.concatenate([at.inputs, material], axis=1), behind),
        behind,
        _products(at.hidden, adjusted),
    ]
    by_number = np.concatenate(parts, axis=2, dtype=Single)[..., free].swapaxes(0, 1)
    return _Linear(rows, np.stack(by_state, axis=2).astype(Single).swapaxes(0, 1), by_number)


def _products(left: Float[np.ndarray, "*left contacts a"], right: Float[np.ndarray, "*right contacts b"]) -> Floats:
    """(3, C, A B) all products of two, one of which has the axis of the accelerations."""
    out = left[..., :, None] * right[..., None, :]
    return out.reshape(*out.shape[:2], out.shape[2] * out.shape[3])
