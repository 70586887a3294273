"""The field of one motion, in plain numbers: for eight of them, every call of numpy costs more than the arithmetic.

`dynamics.py` is the same for many motions at once; a test compares the two.
"""

import math

import numpy as np
from jaxtyping import Float

from odeform.mechanics.floor import GRAVITY
from odeform.mechanics.rolling.contact import ADJUSTED, INPUTS, PLACES, REACHING, RollingContact
from odeform.mechanics.rolling.dynamics import (
    AHEAD,
    AROUND,
    CLEAR,
    DEEP,
    DEPTHS,
    EXPONENTS,
    FADING,
    POWERS,
    SHARES,
    SPIN,
    STATE,
    UPWARD,
)
from odeform.mechanics.rolling.support import Support
from odeform.solver.method import Field
from odeform.solver.runge_kutta import gemv
from odeform.types import Floats

__all__ = ["make_field", "units_of"]

FULL = 2.0 * math.pi
FIRST, APART = float(PLACES[0]), float(PLACES[1] - PLACES[0])


def units_of(radius: float) -> Float[np.ndarray, "8"]:
    """What the entries of a state are multiplied by to be integrated: angle and spin become the way and the speed of
    the rim, so that a solver bounds errors in m and m/s alike."""
    units = np.ones(STATE)
    units[[2, 5]] = radius
    return units


def make_field(law: RollingContact, support: Support, radius: float, material: Floats) -> Field:
    """(t, state (8,) in `units_of(radius)`) -> its slope, for the material (Q,) of one body of `radius` m."""
    logs = {name: float(value[0]) for name, value in law.coefficients(material[None]).items()}
    bases = np.array([logs[name] for name in ADJUSTED])
    power = math.exp(min(max(logs["power"], POWERS[0]), POWERS[1]))
    damping_power = 1.0 / (1.0 + math.exp(-logs["damping_power"]))
    touch, lever = 1e-3 * logs["touch"], radius * (1.0 + 0.1 * logs["radius"])
    inertia, share = math.exp(logs["inertia"]) * radius**2, math.exp(min(max(logs["corners"], SHARES[0]), SHARES[1]))
    settled = 1e-3 * (law.settled @ np.concatenate([[1.0], material]))
    # evenly spaced Gaussians are one Gaussian times a polynomial of an exponential, highest power first
    along = APART / REACHING
    bumps = (settled * np.exp(-0.5 * (along * np.arange(len(settled))) ** 2))[::-1].tolist()
    leaning = [along * order * bump for order, bump in zip(reversed(range(len(bumps))), bumps, strict=True)]
    first, last = np.asfortranarray(law.first[:INPUTS].T), np.asfortranarray(law.last.T)
    bias, product = law.bias + material @ law.first[INPUTS:], gemv(bases.dtype)
    (heights, slopes), places = support.lists, len(support.heights) - 1
    quick, slow = FADING
    lowest, highest = EXPONENTS
    shallowest, deepest = DEPTHS

    def field(_: float, state: Floats) -> Floats:
        _, height, angle, ahead, rising, rim, one, two = state.tolist()
        angle, spin = angle / radius, rim / radius
        if not math.isfinite(height + angle + ahead + rising + spin):  # the integration ends here, with a status
            return np.full_like(state, np.nan)
        fast = rise = turn = 0.0
        one, two = -one / quick, -two / slow
        if touch + CLEAR > height:
            place = angle / FULL % 1.0 * places
            index = min(int(place), places - 1)
            part = place - index
            corner = heights[index] * (1.0 - part) + heights[index + 1] * part
            corner_slope = slopes[index] * (1.0 - part) + slopes[index + 1] * part
            gap, tilt = touch - height + share * corner, 0.0
            turned = (angle + math.pi) % FULL - math.pi
            if abs(turned) < AROUND:
                apart = (turned - FIRST) / REACHING
                base, ratio, high, lean = math.exp(-0.5 * apart * apart), math.exp(along * apart), 0.0, 0.0
                for bump, by in zip(bumps, leaning, strict=True):
                    high, lean = high * ratio + bump, lean * ratio + by
                gap += base * high
                tilt = base * (lean - apart * high) / REACHING
            depth, sliding = min(max(100.0 * gap, shallowest), deepest), ahead - lever * spin
            inputs = np.array((depth / DEEP, rising / UPWARD, abs(sliding), abs(ahead) / AHEAD))
            exponents = product(1.0, last, np.tanh(product(1.0, first, inputs, 1.0, bias)), 1.0, bases)
            strong = np.exp(np.minimum(np.maximum(exponents, lowest), highest))
            stiffness, damping, friction, rolling, grip, felt = strong.tolist()
            push = stiffness * depth**power * max(1.0 - damping * depth**damping_power * rising, 0.0)
            fast = -friction * push * math.tanh(sliding / grip)
            rise = push
            brake = rolling * math.tanh(spin / SPIN)
            turn = (-fast * lever - push * (brake + felt * corner_slope + tilt)) / inertia
            one += depth / quick
            two += depth / slow
        slope = [ahead, rising, rim, fast, rise - GRAVITY, radius * turn, one, two]
        return np.array(slope, dtype=state.dtype)

    return field
