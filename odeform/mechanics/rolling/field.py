"""The field of one motion, for a solver: as plain loops, which Numba compiles, or in NumPy where it does not.

`RollingDynamics` is that of many motions at once, in NumPy; a test compares the two.
"""

import math
from typing import no_type_check

import numpy as np
from jaxtyping import Float

from odeform.compiling import compiles
from odeform.mechanics.floor import GRAVITY
from odeform.mechanics.rolling.contact import ADJUSTED, HIDDEN, INPUTS, PLACES, REACHING, RollingContact
from odeform.mechanics.rolling.dynamics import (
    AHEAD,
    AROUND,
    CLEAR,
    DEEP,
    DEPTHS,
    EXPONENTS,
    FADING,
    MOVING,
    SPIN,
    STATE,
    UPWARD,
    RollingDynamics,
)
from odeform.mechanics.rolling.support import Support
from odeform.solver.compiled import CompiledField
from odeform.solver.method import Field
from odeform.types import Floats

__all__ = ["make_field", "units_of"]

FULL = 2.0 * math.pi
FIRST, ALONG, COUNT = float(PLACES[0]), float(PLACES[1] - PLACES[0]) / REACHING, len(PLACES)
STRONG = len(ADJUSTED)
# where the numbers of one motion begin, after those that are named in `_slope`, and those of the contact
BASES, BIAS, BUMPS, LEANING = np.cumsum([7, STRONG, HIDDEN, COUNT]).tolist()
LAST, HEIGHTS = INPUTS * HIDDEN, (INPUTS + STRONG) * HIDDEN


def units_of(radius: float) -> Float[np.ndarray, "8"]:
    """Factors by which the entries of a state are multiplied to be integrated: angle and spin become the way and the
    speed of the rim, so that a solver bounds errors in m and m/s alike."""
    units = np.ones(STATE)
    units[[2, 5]] = radius
    return units


def make_field(contact: RollingContact, support: Support, radius: float, material: Floats) -> Field:
    """Maps (t, state (8,) in `units_of(radius)`) to its slope, for the material (Q,) of one body of `radius` m."""
    dynamics = RollingDynamics(contact, support, radius, material[None])
    if not compiles():
        return _in_numpy(dynamics)
    settled = dynamics.settled[0]
    # evenly spaced Gaussians are one Gaussian times a polynomial of an exponential, highest power first
    bumps = (settled * np.exp(-0.5 * (ALONG * np.arange(COUNT)) ** 2))[::-1]
    leaning = ALONG * np.arange(COUNT)[::-1] * bumps
    numbers = [
        getattr(dynamics, name)[0]
        for name in ("contact_height", "lever", "inertia", "corner_weight", "power", "damping_power")
    ]
    own = np.concatenate([[*numbers, radius], dynamics.bases[0], dynamics.bias[0], bumps, leaning])
    return CompiledField(_slope, own, shared_numbers(contact, support), np.array([len(support.heights)]))


def shared_numbers(contact: RollingContact, support: Support) -> Float[np.ndarray, " numbers"]:
    """Collects what all motions have in common, as `_slope` is given it."""
    return np.concatenate([contact.first[:INPUTS].ravel(), contact.last.ravel(), support.heights, support.slopes])


def _in_numpy(dynamics: RollingDynamics) -> Field:
    units = units_of(dynamics.radius)

    def field(_: float, state: Floats) -> Floats:
        if not math.isfinite(state[1 : 2 * MOVING].sum()):  # the integration ends here, with a status
            return np.full_like(state, np.nan)
        return (dynamics.slopes((state / units)[:, None])[:, 0] * units).astype(state.dtype)

    return field


@no_type_check
def _slope(state: Floats, own: Floats, shared: Floats, sizes: Floats, out: Floats) -> None:
    """See `odeform.mechanics.rolling.dynamics`, whose arithmetic this is, for one state in `units_of` its radius."""
    contact_height, lever, inertia, corner_weight, power, damping_power, radius = (
        own[0],
        own[1],
        own[2],
        own[3],
        own[4],
        own[5],
        own[6],
    )
    height, angle, ahead, rising, spin = state[1], state[2] / radius, state[3], state[4], state[5] / radius
    if not math.isfinite(height + angle + ahead + rising + spin):  # the integration ends here, with a status
        out[:] = np.nan
        return
    fast, rise, turn, depth = 0.0, 0.0, 0.0, 0.0
    if contact_height + CLEAR > height:
        places = sizes[0] - 1
        place = angle / FULL % 1.0 * places
        index = min(int(place), places - 1)
        part = place - index
        at = HEIGHTS + index
        corner = shared[at] + part * (shared[at + 1] - shared[at])
        at += sizes[0]
        corner_slope = shared[at] + part * (shared[at + 1] - shared[at])
        gap, tilt = contact_height - height + corner_weight * corner, 0.0
        turned = (angle + math.pi) % FULL - math.pi
        if abs(turned) < AROUND:
            apart = (turned - FIRST) / REACHING
            ratio, high, lean = math.exp(ALONG * apart), 0.0, 0.0
            for k in range(COUNT):
                high, lean = high * ratio + own[BUMPS + k], lean * ratio + own[LEANING + k]
            base = math.exp(-0.5 * apart * apart)
            gap += base * high
            tilt = base * (lean - apart * high) / REACHING
        depth, sliding = min(max(100.0 * gap, DEPTHS[0]), DEPTHS[1]), ahead - lever * spin
        strong = np.empty(STRONG)
        strong[:] = own[BASES : BASES + STRONG]
        for j in range(HIDDEN):
            hidden = own[BIAS + j] + shared[j] * depth / DEEP + shared[HIDDEN + j] * rising / UPWARD
            hidden += shared[2 * HIDDEN + j] * abs(sliding) + shared[3 * HIDDEN + j] * abs(ahead) / AHEAD
            hidden = math.tanh(hidden)
            for k in range(STRONG):
                strong[k] += hidden * shared[LAST + j * STRONG + k]
        for k in range(STRONG):
            strong[k] = math.exp(min(max(strong[k], EXPONENTS[0]), EXPONENTS[1]))
        stiffness, damping, friction, rolling, regularisation, felt = strong
        rise = stiffness * depth**power * max(1.0 - damping * depth**damping_power * rising, 0.0)
        fast = -friction * rise * math.tanh(sliding / regularisation)
        brake = rolling * math.tanh(spin / SPIN)
        turn = (-fast * lever - rise * (brake + felt * corner_slope + tilt)) / inertia
    out[0], out[1], out[2] = ahead, rising, state[5]
    out[3], out[4], out[5] = fast, rise - GRAVITY, radius * turn
    out[6], out[7] = (depth - state[6]) / FADING[0], (depth - state[7]) / FADING[1]
