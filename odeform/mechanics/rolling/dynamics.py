"""The right-hand side of the ODE of a round body that flies, lands and rolls under a learned law of contact.

The state of a body that moves in a vertical plane has eight numbers: how far it is ahead (m), how high (m), its angle
(rad), their rates, and two memories of how deep it was (cm), which fade in `FADING` seconds. With the depth d in cm,

    N = k d^p max(1 - c d^q z', 0),   F = -mu N tanh(u / grip),

are the accelerations by which the floor pushes up, and brakes a contact that slides with the speed u. The depth depends
on the angle: a mesh has corners, and its own weight has settled the body where it rested. That turns it, too.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.mechanics.floor import GRAVITY
from odeform.mechanics.rolling.law import ADJUSTED, PLACES, REACHING, RollingLaw
from odeform.mechanics.rolling.support import Support
from odeform.types import Floats, Ints

__all__ = ["FADING", "MOVING", "STATE", "RollingDynamics"]

MOVING = 3
"""Coordinates of the position, which come first; their rates come next."""
FADING = (0.008, 0.025)
STATE = 2 * MOVING + len(FADING)
CLEAR = 2e-3  # m above the touch from which on nothing touches, corners included
FASTEST = 60.0  # m/s and rad/s: rates beyond are no motion, and are kept from overflowing
DEEP, UPWARD, AHEAD = 2.0, 2.0, 2.0  # units of the network's inputs: cm, m/s, m/s
EXPONENTS = (-12.0, 8.0)
DEPTHS = (1e-9, 1e3)  # cm: what is shallower does not touch, what is deeper is lost
SPIN = 1.0  # rad/s, from which on rolling is braked fully


@dataclass(frozen=True, eq=False)
class _Contact:
    """What all motions of one call share, (...) by law and motion."""

    logs: dict[str, Floats]
    power: Floats
    damping_power: Floats
    touch: Floats
    lever: Floats
    inertia: Floats
    settled: Floats


class RollingDynamics:
    """The field of B laws and M motions at once."""

    def __init__(
        self, law: RollingLaw, support: Support, radius: float, material: Float[np.ndarray, "motions materials"]
    ) -> None:
        """`law` has one leading axis (B); `radius` is that of the body in m, `material` that of each motion."""
        self._law, self._support = law, support
        self._material = material
        logs = law.coefficients(material)
        linear = np.concatenate([np.ones((len(material), 1)), material], axis=1)
        self._contact = _Contact(
            logs,
            np.exp(np.clip(logs["power"], -3.0, 2.0)),
            1.0 / (1.0 + np.exp(-logs["damping_power"])),
            1e-3 * logs["touch"],
            radius * (1.0 + 0.1 * logs["radius"]),
            np.exp(logs["inertia"]) * radius**2,
            1e-3 * np.einsum("bpt,mt->bmp", law.settled, linear),
        )

    def slopes(self, states: Float[np.ndarray, "states laws motions"]) -> Floats:
        """(8, B, M) -> (8, B, M)."""
        shared, out = self._contact, np.zeros_like(states)
        ahead, rising, spin = out[:MOVING] = states[MOVING : 2 * MOVING]
        out[4] = -GRAVITY
        out[6:] = -states[6:] / np.array(FADING)[:, None, None]
        near = shared.touch + CLEAR > states[1]
        laws, motions = np.nonzero(near)
        if not len(laws):
            return out
        angle, fast, up, turning = states[2][near], ahead[near], rising[near], spin[near]
        lever, inertia = shared.lever[near], shared.inertia[near]
        corners, corner_slopes = self._support.at(angle)
        settled, settled_slopes = self._settled(angle, laws, motions)
        high = shared.touch[near] + settled - states[1][near]
        share = np.exp(np.clip(shared.logs["corners"][near], -6.0, 1.0))
        depth = np.clip(100.0 * (high + share * corners), *DEPTHS)
        sliding = fast - lever * turning
        strong = self._adjusted(depth, up, sliding, fast, laws, motions)
        push = strong["stiffness"] * depth ** shared.power[near]
        push *= np.maximum(1.0 - strong["damping"] * depth ** shared.damping_power[near] * up, 0.0)
        drag = -strong["friction"] * push * np.tanh(sliding / strong["grip"])
        brake = strong["rolling"] * np.tanh(turning / SPIN)
        torque = -drag * lever - push * (brake + strong["corners"] * corner_slopes + settled_slopes)
        out[3][near] += drag
        out[4][near] += push
        out[5][near] += torque / inertia
        for index, fading in enumerate(FADING):
            out[6 + index][near] += depth / fading
        return out

    def _settled(self, angle: Floats, laws: Ints, motions: Ints) -> tuple[Floats, Floats]:
        """How much higher (m) the body stands where it has settled, and the slope by the angle (m per rad)."""
        height, slope = np.zeros_like(angle), np.zeros_like(angle)
        turned = np.mod(angle + np.pi, 2.0 * np.pi) - np.pi
        here = np.flatnonzero(np.abs(turned) < PLACES[-1] + 4.0 * REACHING)
        if len(here):
            apart = (turned[here, None] - PLACES) / REACHING
            each = self._contact.settled[laws[here], motions[here]] * np.exp(-0.5 * apart**2)
            height[here], slope[here] = each.sum(axis=1), (-apart / REACHING * each).sum(axis=1)
        return height, slope

    def _adjusted(
        self, depth: Floats, up: Floats, sliding: Floats, fast: Floats, laws: Ints, motions: Ints
    ) -> dict[str, Floats]:
        """The coefficients that the network changes, for each contact (C,)."""
        inputs = [depth / DEEP, up / UPWARD, np.abs(sliding), np.abs(fast) / AHEAD]
        x = np.concatenate([np.stack(inputs, axis=1), self._material[motions]], axis=1)
        added, law = np.empty((len(x), len(ADJUSTED))), self._law
        cuts = np.searchsorted(laws, np.arange(len(law.bias) + 1))
        for index, (begin, end) in enumerate(itertools.pairwise(cuts)):
            hidden = np.tanh(x[begin:end] @ law.first[index] + law.bias[index])
            added[begin:end] = hidden @ law.last[index]
        logs = self._contact.logs
        return {
            name: np.exp(np.clip(logs[name][laws, motions] + added[:, i], *EXPONENTS))
            for i, name in enumerate(ADJUSTED)
        }

    def roll_out(self, start: Float[np.ndarray, "states motions"], steps: int, count: int, step: float) -> Floats:
        """(T, 8, B, M) from states (8, M): at the start and after each `steps` midpoint steps of `step` s."""
        state = np.repeat(start[:, None], len(self._law.bias), axis=1)
        out = np.empty((count + 1, *state.shape))
        out[0] = state
        for frame in range(1, count + 1):
            for _ in range(steps):
                middle = state + 0.5 * step * self.slopes(state)
                state = state + step * self.slopes(middle)
                np.clip(state[MOVING : 2 * MOVING], -FASTEST, FASTEST, out=state[MOVING : 2 * MOVING])
            out[frame] = state
        return out
