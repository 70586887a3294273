"""The field of one motion, in plain numbers: for eight of them, every call of numpy costs more than the arithmetic.

`dynamics.py` is the same for many motions at once; a test compares the two.
"""

import math

import numpy as np

from odeform.mechanics.floor import GRAVITY
from odeform.mechanics.rolling.dynamics import AHEAD, CLEAR, DEEP, DEPTHS, EXPONENTS, FADING, SPIN, UPWARD
from odeform.mechanics.rolling.law import ADJUSTED, PLACES, REACHING, RollingLaw
from odeform.mechanics.rolling.support import Support
from odeform.solver.method import Field
from odeform.types import Floats

__all__ = ["make_field"]

FULL = 2.0 * math.pi
AROUND = float(PLACES[-1]) + 4.0 * REACHING


def make_field(law: RollingLaw, support: Support, radius: float, material: Floats) -> Field:
    """(t, state (8,)) -> its slope, for the material (Q,) of one body of `radius` m."""
    logs = {name: float(value[0]) for name, value in law.coefficients(material[None]).items()}
    bases = [logs[name] for name in ADJUSTED]
    power = math.exp(min(max(logs["power"], -3.0), 2.0))
    damping_power = 1.0 / (1.0 + math.exp(-logs["damping_power"]))
    touch, lever = 1e-3 * logs["touch"], radius * (1.0 + 0.1 * logs["radius"])
    inertia, share = math.exp(logs["inertia"]) * radius**2, math.exp(min(max(logs["corners"], -6.0), 1.0))
    settled = 1e-3 * (law.settled @ np.concatenate([[1.0], material]))
    first, last = np.ascontiguousarray(law.first[:4].T), np.ascontiguousarray(law.last.T)
    bias = law.bias + material @ law.first[4:]
    heights, slopes, places = support.heights, support.slopes, len(support.heights) - 1
    quick, slow = FADING
    low, high = EXPONENTS
    shallowest, deepest = DEPTHS
    inputs = np.empty(4)

    def field(_: float, state: Floats) -> Floats:
        _, height, angle, ahead, rising, spin, one, two = state.tolist()
        if not math.isfinite(height + angle + ahead + rising + spin):  # the integration ends here, with a status
            return np.full_like(state, np.nan)
        fast = rise = turn = 0.0
        one, two = -one / quick, -two / slow
        if touch + CLEAR > height:
            place = angle / FULL % 1.0 * places
            index = min(int(place), places - 1)
            part = place - index
            corner = float(heights[index]) * (1.0 - part) + float(heights[index + 1]) * part
            corner_slope = float(slopes[index]) * (1.0 - part) + float(slopes[index + 1]) * part
            gap, tilt = touch - height + share * corner, 0.0
            turned = (angle + math.pi) % FULL - math.pi
            if abs(turned) < AROUND:
                apart = (turned - PLACES) / REACHING
                each = settled * np.exp(-0.5 * apart * apart)
                gap += float(each.sum())
                tilt -= float(apart @ each) / REACHING
            depth, sliding = min(max(100.0 * gap, shallowest), deepest), ahead - lever * spin
            inputs[:] = depth / DEEP, rising / UPWARD, abs(sliding), abs(ahead) / AHEAD
            added = (last @ np.tanh(first @ inputs + bias)).tolist()
            stiffness, damping, friction, rolling, grip, felt = (
                math.exp(min(max(base + more, low), high)) for base, more in zip(bases, added, strict=True)
            )
            push = stiffness * depth**power * max(1.0 - damping * depth**damping_power * rising, 0.0)
            fast = -friction * push * math.tanh(sliding / grip)
            rise = push
            brake = rolling * math.tanh(spin / SPIN)
            turn = (-fast * lever - push * (brake + felt * corner_slope + tilt)) / inertia
            one += depth / quick
            two += depth / slow
        return np.array([ahead, rising, spin, fast, rise - GRAVITY, turn, one, two], dtype=state.dtype)

    return field
