"""Explicit Runge-Kutta steps of many problems as one loop of machine code: `integrate.py`, compiled.

Imported when the first problem is solved: it takes Numba, which takes a second. The loop calls the field through a
pointer, so that each is compiled, and kept on disk, by itself.
"""

import math
from typing import no_type_check

import numpy as np
from numba import njit

from odeform.solver.step_control import GROW, SAFETY, SHRINK

__all__ = ["DONE", "FULL", "MANY", "NON_FINITE", "STUCK", "advance", "slopes_of"]

DONE, FULL, MANY, STUCK, NON_FINITE = range(5)
"""How a call ended: at the time that was asked for, out of room, or with a failure."""
OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**OPTIONS)
@no_type_check
def slopes_of(slope, own, shared, sizes, states, out):
    """Computes the fields `out` (B, n) at states (B, n) of problems with numbers `own` (B, k)."""
    for row in range(len(states)):
        slope(states[row], own[row], shared, sizes, out[row])


@njit(**OPTIONS)
@no_type_check
def _rms(values):
    total = 0.0
    for value in values:
        total += value * value
    return math.sqrt(total / len(values))


@njit(**OPTIONS)
@no_type_check
def _add(out, state, step, weights, slopes):
    """out = state + step * sum_i weights[i] slopes[i]"""
    out[:] = 0.0
    for i in range(len(weights)):
        for k in range(len(out)):
            out[k] += weights[i] * slopes[i, k]
    for k in range(len(out)):
        out[k] = state[k] + step * out[k]


@njit(**OPTIONS)
@no_type_check
def _first_step(slope, own, shared, sizes, order, state, first, tolerance, moved, bent):
    d0, d1 = _rms(state) / tolerance, _rms(first) / tolerance
    h0 = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    for k in range(len(state)):
        moved[k] = state[k] + h0 * first[k]
    slope(moved, own, shared, sizes, bent)
    for k in range(len(state)):
        bent[k] -= first[k]
    steep = max(d1, _rms(bent) / tolerance / h0)
    h1 = max(1e-6, 1e-3 * h0) if steep <= 1e-15 else (0.01 / steep) ** (1.0 / order)
    return min(100.0 * h0, h1)


@njit(**OPTIONS)
@no_type_check
def _step(slope, own, shared, sizes, stages, state, length, after, kept):
    """Takes a step of `length` seconds to `after` (n,), from the slope kept[0]; the others (E, n) are added to it."""
    for stage in range(len(stages)):
        _add(after, state, length, stages[stage, : stage + 1], kept)
        slope(after, own, shared, sizes, kept[stage + 1])


@njit(**OPTIONS)
@no_type_check
def _is_finite(one, other):
    total = 0.0
    for k in range(len(one)):
        total += one[k] + other[k]
    return math.isfinite(total)


@njit(**OPTIONS)
@no_type_check
def advance(
    slope, own, shared, sizes, stages, error, middle, order, gains, step, tolerance, most, begin, until,
    times, states, slopes, middles, counts, rates, tallies, ended,
):  # fmt: skip
    """Solve B problems, which began at `begin` seconds, each from its last node on, at least to `until` seconds.

    `own` (B, k), `shared` (m,) and `sizes` are what the field is given. Rows of `stages` (E, E) weigh the slopes before
    each evaluation, those of `error` and `middle` all slopes. A `step` of 0 is controlled by `tolerance`.
    Nodes are written to `times` (B, C), `states` and `slopes` (B, C, n) and `middles`, from `counts` (B,) on. `rates`
    (B, 2) are the next step and the last ratio of error and tolerance; `tallies` (B, 3) steps taken before the first
    node, rejected steps and evaluations, none where the first slope is not known; `ended` (B,) how each problem ended.
    """
    size, evaluations, fixed = states.shape[2], len(stages), step > 0.0
    kept = np.empty((evaluations + 1, size), states.dtype)
    after, apart, nothing = np.empty(size, states.dtype), np.empty(size, states.dtype), np.zeros(size, states.dtype)
    for row in range(len(times)):
        at, longest, mine, ended[row] = counts[row] - 1, GROW, own[row], DONE
        if tallies[row, 2] == 0:
            slope(states[row, at], mine, shared, sizes, slopes[row, at])
            tallies[row, 2] = 1
            if not _is_finite(states[row, at], slopes[row, at]):
                ended[row] = NON_FINITE
                continue
        if not fixed and rates[row, 0] == 0.0:
            state, begun = states[row, at], slopes[row, at]
            rates[row, 0] = _first_step(slope, mine, shared, sizes, order, state, begun, tolerance, after, apart)
            tallies[row, 2] += 1
        slack = 1e-9 * step if fixed else 0.0
        while times[row, at] < until - slack:
            taken = tallies[row, 0] + at
            if taken + tallies[row, 1] >= most:
                ended[row] = MANY
                break
            if at + 1 >= times.shape[1]:
                ended[row] = FULL
                break
            time, state = times[row, at], states[row, at]
            length = step if fixed else rates[row, 0]
            if not fixed and time + length <= time:
                ended[row] = STUCK
                break
            kept[0] = slopes[row, at]
            _step(slope, mine, shared, sizes, stages, state, length, after, kept)
            tallies[row, 2] += evaluations
            if fixed:
                if not _is_finite(after, kept[evaluations]):
                    ended[row] = NON_FINITE
                    break
                times[row, at + 1] = begin + (taken + 1) * step
            else:
                _add(apart, nothing, length, error, kept)
                found = _rms(apart) / tolerance
                ratio = max(found, 1e-10)
                if not found <= 1.0:
                    if not math.isfinite(found):
                        ratio = 1e6  # overflow: retry with a much smaller step
                    rates[row, 0] = length * max(SHRINK, SAFETY * ratio ** (-1.0 / order))
                    tallies[row, 1] += 1
                    longest = 1.0
                    continue
                factor = SAFETY * ratio ** (-gains[0] / order) * rates[row, 1] ** (gains[1] / order)
                rates[row, 0] = length * min(longest, max(SHRINK, factor))
                rates[row, 1], longest = max(ratio, 1e-4), GROW
                times[row, at + 1] = time + length
                if len(middle):
                    _add(middles[row, at], state, length, middle, kept)
            at += 1
            states[row, at] = after
            slopes[row, at] = kept[evaluations]
        counts[row] = at + 1
