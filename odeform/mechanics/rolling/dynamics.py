"""The right-hand side of the ODE of a round body that flies, lands and rolls under learned contact parameters.

The state of a body that moves in a vertical plane has eight numbers: how far it is ahead (m), how high (m), its angle
(rad), their rates, and two memories of how deep it was (cm), which fade in `FADING` seconds. With the depth d in cm,

    N = k d^p max(1 - c d^q z', 0),   F = -mu N tanh(u / s),

are the accelerations by which the floor pushes up, and brakes a contact that slides with the speed u. The depth depends
on the angle: a mesh has corners, and its own weight has settled the body where it rested. That turns it, too.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.mechanics.floor import GRAVITY
from odeform.mechanics.rolling.contact import ADJUSTED, INPUTS, PLACES, REACHING, RollingContact
from odeform.mechanics.rolling.support import Support
from odeform.types import Floats, Ints

__all__ = [
    "AHEAD",
    "AROUND",
    "CLEAR",
    "CORNER_WEIGHTS",
    "DEEP",
    "DEPTHS",
    "EXPONENTS",
    "FADING",
    "MOVING",
    "POWERS",
    "SPIN",
    "STATE",
    "UPWARD",
    "Contacts",
    "RollingDynamics",
    "limited",
]

MOVING = 3
"""Coordinates of the position, which come first; their rates come next."""
FADING = (0.008, 0.025)
STATE = 2 * MOVING + len(FADING)
CLEAR = 2e-3  # m above the contact height from which on nothing touches, corners included
FASTEST = 60.0  # m/s and rad/s: rates beyond are no motion, and are kept from overflowing
DEEP, UPWARD, AHEAD = 2.0, 2.0, 2.0  # units of the network's inputs: cm, m/s, m/s
EXPONENTS = (-12.0, 8.0)
POWERS = (-3.0, 2.0)  # the logarithm
CORNER_WEIGHTS = (-6.0, 1.0)  # the logarithm of the weight of corners
DEPTHS = (1e-9, 1e3)  # cm: what is shallower does not touch, what is deeper is lost
AROUND = float(PLACES[-1]) + 4.0 * REACHING  # rad: beyond, nothing has settled
SPIN = 1.0  # rad/s, from which on rolling is braked fully


@dataclass(frozen=True, eq=False)
class Contacts:
    """Describes what the floor does at one moment to the bodies that touch it, (C,) each."""

    rows: Ints
    """Indices among all motions."""
    angle: Floats
    moving: Float[np.ndarray, "3 contacts"]
    """Speed ahead and up, and spin."""
    corners: Floats
    """By how much the corners make the body higher (m)."""
    corner_slopes: Floats
    settled_slopes: Floats
    reached: Float[np.ndarray, "contacts places"]
    """How much each of the places where the body has settled counts."""
    apart: Float[np.ndarray, "contacts places"]
    """How far off they are, in units of `REACHING`."""
    depth: Floats
    """cm."""
    sliding: Floats
    inputs: Float[np.ndarray, "contacts inputs"]
    """Inputs of the network."""
    hidden: Float[np.ndarray, "contacts hidden"]
    exponents: Float[np.ndarray, "contacts adjusted"]
    strong: Float[np.ndarray, "contacts adjusted"]
    """The coefficients that the network changes."""
    spring: Floats
    """The push (m/s^2) without its damping."""
    damped: Floats
    """Its factor; below zero, the floor does not push."""
    mobilised: Floats
    """The fraction of the friction that acts, with its sign."""
    brake: Floats
    """The lever in m by which the push brakes rolling."""
    push: Floats
    drag: Floats
    turn: Floats
    """The angular acceleration."""


class RollingDynamics:
    """The field of M motions at once."""

    def __init__(
        self, contact: RollingContact, support: Support, radius: float, material: Float[np.ndarray, "motions materials"]
    ) -> None:
        """`radius` is that of the body in m, `material` that of each motion."""
        self.contact, self.support, self.radius, self.material = contact, support, radius, material
        self.logs = logs = contact.coefficients(material)
        linear = np.concatenate([np.ones((len(material), 1)), material], axis=1)
        self.settled = 1e-3 * linear @ contact.settled.T
        """(M, places) m by which the bodies stand higher at each of `PLACES`."""
        self.contact_height, self.lever = 1e-3 * logs["height"], radius * (1.0 + 0.1 * logs["radius"])
        self.inertia = np.exp(logs["inertia"]) * radius**2
        self.power = np.exp(np.clip(logs["power"], *POWERS))
        self.damping_power = 1.0 / (1.0 + np.exp(-logs["damping_power"]))
        self.corner_weight = np.exp(np.clip(logs["corners"], *CORNER_WEIGHTS))
        self.bases = np.stack([logs[name] for name in ADJUSTED], axis=1)
        self.bias = contact.bias + material @ contact.first[INPUTS:]

    def slopes(self, states: Float[np.ndarray, "states motions"]) -> Floats:
        """Maps states (8, M) to their slopes (8, M)."""
        return self.with_contacts(states)[0]

    def with_contacts(self, states: Float[np.ndarray, "states motions"]) -> tuple[Floats, Contacts]:
        """Returns the `slopes` (8, M), and what causes them."""
        out = np.empty_like(states)
        out[:MOVING] = states[MOVING : 2 * MOVING]
        out[MOVING : 2 * MOVING] = np.array([0.0, -GRAVITY, 0.0])[:, None]
        out[6:] = -states[6:] / np.array(FADING)[:, None]
        touching = self._contacts(states)
        rows = touching.rows
        out[3, rows] = touching.drag
        out[4, rows] += touching.push
        out[5, rows] = touching.turn
        for index, fading in enumerate(FADING):
            out[6 + index, rows] += touching.depth / fading
        return out, touching

    def _contacts(self, states: Floats) -> Contacts:
        rows = np.flatnonzero(self.contact_height + CLEAR > states[1])
        height, angle = states[1, rows], states[2, rows]
        moving = fast, up, spin = states[MOVING : 2 * MOVING, rows]
        corners, corner_slopes = self.support.at(angle)
        turned = np.mod(angle + np.pi, 2.0 * np.pi) - np.pi
        apart = (turned[:, None] - PLACES) / REACHING
        reached = np.exp(-0.5 * apart**2) * (np.abs(turned) < AROUND)[:, None]
        settled = reached * self.settled[rows]
        settled_slopes = -(apart * settled).sum(axis=1) / REACHING
        gap = self.contact_height[rows] + settled.sum(axis=1) - height + self.corner_weight[rows] * corners
        depth = np.clip(100.0 * gap, *DEPTHS)
        lever = self.lever[rows]
        sliding = fast - lever * spin
        inputs = np.stack([depth / DEEP, up / UPWARD, np.abs(sliding), np.abs(fast) / AHEAD], axis=1)
        hidden = np.tanh(inputs @ self.contact.first[:INPUTS] + self.bias[rows])
        exponents = self.bases[rows] + hidden @ self.contact.last
        strong = np.exp(np.clip(exponents, *EXPONENTS))
        stiffness, damping, friction, rolling, regularisation, felt = strong.T
        spring = stiffness * depth ** self.power[rows]
        damped = 1.0 - damping * depth ** self.damping_power[rows] * up
        push = spring * np.maximum(damped, 0.0)
        mobilised = np.tanh(sliding / regularisation)
        drag = -friction * push * mobilised
        brake = rolling * np.tanh(spin / SPIN)
        torque = -drag * lever - push * (brake + felt * corner_slopes + settled_slopes)
        return Contacts(
            rows=rows,
            angle=angle,
            moving=moving,
            corners=corners,
            corner_slopes=corner_slopes,
            settled_slopes=settled_slopes,
            reached=reached,
            apart=apart,
            depth=depth,
            sliding=sliding,
            inputs=inputs,
            hidden=hidden,
            exponents=exponents,
            strong=strong,
            spring=spring,
            damped=damped,
            mobilised=mobilised,
            brake=brake,
            push=push,
            drag=drag,
            turn=torque / self.inertia[rows],
        )

    def roll_out(self, start: Float[np.ndarray, "states motions"], steps: int, count: int, step: float) -> Floats:
        """(T, 8, M) from states (8, M): at the start and after each `steps` midpoint steps of `step` s."""
        state = start
        out = np.empty((count + 1, *state.shape))
        out[0] = state
        for frame in range(1, count + 1):
            for _ in range(steps):
                middle = state + 0.5 * step * self.slopes(state)
                state = state + step * self.slopes(middle)
                limited(state)
            out[frame] = state
        return out


def limited(state: Float[np.ndarray, "states motions"]) -> None:
    """Keeps the rates of states (8, M) from overflowing, in place."""
    np.clip(state[MOVING : 2 * MOVING], -FASTEST, FASTEST, out=state[MOVING : 2 * MOVING])
