"""How roll-outs of a rolling body change with each number of the law of contact: forward sensitivities.

With the state x, the numbers p of the law and the field f of `dynamics.py`, S = dx/dp follows dS/dt = (df/dx) S + df/dp
(Hairer, Norsett and Wanner 1993, I.14). S is that of the discrete motion: each midpoint step is differentiated.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from odeform.mechanics.rolling.dynamics import (
    AHEAD,
    DEEP,
    DEPTHS,
    EXPONENTS,
    MOVING,
    POWERS,
    SHARES,
    SPIN,
    UPWARD,
    Contacts,
    RollingDynamics,
    limited,
)
from odeform.mechanics.rolling.law import ADJUSTED, COEFFICIENTS, INPUTS, PLAIN, REACHING, material_terms
from odeform.types import Floats, Ints

__all__ = ["roll_out_with_sensitivities"]

NAMES = [*COEFFICIENTS, *PLAIN]  # in the order of the law's terms
Single = np.float32  # of sensitivities: they are many, and a step of a fit needs few digits


class _Linear(NamedTuple):
    """The accelerations (3,) of contacts (C,), linearised."""

    rows: Ints
    by_state: Float[np.ndarray, "contacts 3 5"]
    """By height, angle, speed, rising and spin."""
    by_law: Float[np.ndarray, "contacts 3 free"]


def roll_out_with_sensitivities(
    dynamics: RollingDynamics,
    free: Ints,
    start: Float[np.ndarray, "states motions"],
    steps: int,
    count: int,
    step: float,
) -> tuple[Floats, Float[np.ndarray, "times motions 3 free"]]:
    """`dynamics.roll_out` from states (8, M) that do not depend on the law: states (T, 8, M), and how the positions in
    them change with the numbers of the law of the indices `free` (F,), (T, M, 3, F)."""
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
    pushed = linear.by_state @ here[rows, 1 : 2 * MOVING] + linear.by_law
    changes[:, :MOVING] += Single(step) * here[:, MOVING:]
    changes[rows, MOVING:] += Single(step) * pushed


def _linearised(dynamics: RollingDynamics, at: Contacts, free: Ints) -> _Linear:
    """Of the accelerations ahead, up and turning (3,), by the chain rule: by what acts on them directly, first."""
    rows, law = at.rows, dynamics.law
    fast, up, spin = at.moving
    _, damping, friction, rolling, slow, felt = at.strong.T
    lever, inertia, power = dynamics.lever[rows], dynamics.inertia[rows], dynamics.power[rows]
    faster = dynamics.damping_power[rows]
    pushes, logs = (at.damped > 0.0) * 1.0, np.log(at.depth)
    strength = damping * at.depth**faster

    def of(push: Floats, drag: Floats | float = 0.0, torque: Floats | float = 0.0) -> Floats:
        """(3, C) from the derivatives of the push, and what else the drag and the torque depend on."""
        ahead = drag - friction * at.grip * push
        levers = at.brake + felt * at.corner_slopes + at.settled_slopes
        return np.stack([ahead, push, (torque - lever * ahead - levers * push) / inertia])

    nothing = np.zeros(len(rows))
    slip = -friction * at.push * (1.0 - at.grip**2) / slow
    by_depth = of((power * at.push - pushes * at.spring * strength * faster * up) / at.depth)
    by_up = of(-pushes * at.spring * strength)
    by_sliding = of(nothing, slip)
    by_spin = of(nothing, torque=-at.push * rolling * (1.0 - np.tanh(spin / SPIN) ** 2) / SPIN)
    by_slope = of(nothing, torque=-at.push)
    by_exponent = {
        "stiffness": of(at.push),
        "damping": of(-pushes * at.spring * strength * up),
        "friction": of(nothing, at.drag),
        "rolling": of(nothing, torque=-at.push * at.brake),
        "grip": of(nothing, -slip * at.sliding),
        "corners": of(nothing, torque=-at.push * felt * at.corner_slopes),
    }
    inside = (at.exponents > EXPONENTS[0]) & (at.exponents < EXPONENTS[1])
    adjusted = np.stack([by_exponent[name] for name in ADJUSTED], axis=2) * inside

    # through the network: of what it is told, and of its weights
    behind = (adjusted @ law.last.T) * (1.0 - at.hidden**2)
    told = behind @ law.first[:INPUTS].T / np.array([DEEP, UPWARD, 1.0, AHEAD])
    by_depth = by_depth + told[..., 0]
    by_up = by_up + told[..., 1]
    by_sliding = by_sliding + told[..., 2] * np.sign(at.sliding)
    by_ahead = told[..., 3] * np.sign(fast)

    deep = (at.depth > DEPTHS[0]) & (at.depth < DEPTHS[1])
    by_gap, share = 100.0 * deep * by_depth, dynamics.share[rows]
    settled = at.reached * dynamics.settled[rows]
    bent = felt * dynamics.support.bends(at.angle) + ((at.apart**2 - 1.0) * settled).sum(axis=1) / REACHING**2
    by_angle = by_gap * (at.settled_slopes + share * at.corner_slopes) + by_slope * bent
    by_state = [-by_gap, by_angle, by_sliding + by_ahead, by_up, by_spin - lever * by_sliding]

    log_power, log_share = dynamics.logs["power"][rows], dynamics.logs["corners"][rows]
    by_name = dict(zip(ADJUSTED, np.moveaxis(adjusted, 2, 0), strict=True))
    by_name["power"] = of(at.push * logs * power) * ((log_power > POWERS[0]) & (log_power < POWERS[1]))
    by_name["damping_power"] = of(-pushes * at.spring * strength * up * logs * faster * (1.0 - faster))
    by_name["inertia"] = np.stack([nothing, nothing, -at.turn])
    by_name["corners"] = by_name["corners"] + by_gap * share * at.corners * (
        (log_share > SHARES[0]) & (log_share < SHARES[1])
    )
    by_name["touch"] = 1e-3 * by_gap
    by_name["radius"] = 0.1 * dynamics.radius * (of(nothing, torque=-at.drag) - spin * by_sliding)

    material = dynamics.material[rows]
    linear = np.concatenate([np.ones((len(rows), 1)), material], axis=1)
    places = 1e-3 * (by_gap[..., None] * at.reached - by_slope[..., None] * at.apart * at.reached / REACHING)
    inputs = np.concatenate([at.inputs, material], axis=1)
    parts = [
        _products(np.stack([by_name[name] for name in NAMES], axis=2), material_terms(material)),
        _products(places, linear),
        _products(inputs, behind),
        behind,
        _products(at.hidden, adjusted),
    ]
    by_law = np.concatenate(parts, axis=2, dtype=Single)[..., free].swapaxes(0, 1)
    return _Linear(rows, np.stack(by_state, axis=2).astype(Single).swapaxes(0, 1), by_law)


def _products(left: Float[np.ndarray, "*three contacts a"], right: Float[np.ndarray, "*three contacts b"]) -> Floats:
    """(3, C, A B) all products of two, one of which has the axis of the accelerations."""
    out = left[..., :, None] * right[..., None, :]
    return out.reshape(*out.shape[:2], out.shape[2] * out.shape[3])
