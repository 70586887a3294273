"""The step in time of `odeform.mechanics.step.Steps` as machine code, one motion after the other.

Why, and what the formulas mean, is said in `compiled_contacts`.
"""

from typing import no_type_check

import numpy as np

from odeform.compiling import compiled_with
from odeform.mechanics import compiled_algebra, compiled_contacts, compiled_forces
from odeform.mechanics.compiled_algebra import room, solve
from odeform.mechanics.compiled_contacts import PUSH, copy, find_near, linearise, linearise_hold
from odeform.mechanics.compiled_forces import (
    along,
    drag_of,
    free_motion,
    local_velocity,
    move,
    resist,
    rotate,
    set_masses,
)

__all__ = ["SOURCES", "advance_all", "follow", "second_order", "slope_between", "slope_of"]

AHEAD = 0.02
SHORTEST = 1e-9
LONGEST = 0.25
SOURCES = (compiled_algebra.__file__, compiled_contacts.__file__, compiled_forces.__file__)
"""Files whose functions it calls."""

compiled = compiled_with(__file__, *SOURCES)


@compiled
@no_type_check
def _solve_apart(matrix, right):
    """What `solve` does, for a matrix of masses, in which only the inertia is more than a diagonal."""
    for k in range(len(right)):
        if k < 3 or k > 5:
            right[k] /= matrix[k, k]
    return solve(matrix[3:6, 3:6], right[3:6])


@compiled
@no_type_check
def _implicit(c, b, z, size, pushed, step, end, chosen, floor, count, jacobian, gaps, springs, away, rows, matrix, out):
    """The state after one step of first order, which ends at a time; false where it cannot be solved for."""
    width = 6 + size + (1 if pushed else 0)
    v, momentum, rate, right = np.empty(width), np.empty(width), np.empty(width), np.empty(width)
    local_velocity(z, size, v)
    free_motion(c, b, z, size, pushed, end, v, momentum, rate)
    for k in range(width):
        momentum[k] += step * rate[k]
    touches = count > 0 or len(away) > 0
    # where nothing touches it, the second sweep would find the same
    for _ in range(2 if touches else 1):
        set_masses(c, b, size, pushed, step * (step + c.relaxation), matrix)
        copy(momentum, right)
        resist(c, b, step, v, chosen, floor, count, jacobian, gaps, springs, away, rows, matrix, right)
        if not (solve(matrix, right) if touches else _solve_apart(matrix, right)):
            return False
        for k in range(width):
            v[k] = right[k]
    move(z, v, size, pushed, step, out)
    return True


@compiled
@no_type_check
def second_order(c, size, pushed, whole, out):
    """Make a state after two half steps that of second order, from that after a whole one; returns the error in m."""
    # twice two half steps less a whole one
    turn, start = np.empty((3, 3)), 13 + size
    for row in range(3):
        for column in range(3):
            total = 0.0
            for k in range(3):
                total += out[3 + 3 * row + k] * whole[3 + 3 * column + k]
            turn[row, column] = total
    between = np.empty(6 + size)
    for axis in range(3):
        between[axis] = out[axis] - whole[axis]
    s0, s1, s2 = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
    sine = 0.5 * np.sqrt(s0 * s0 + s1 * s1 + s2 * s2) + 1e-150
    angle = 0.5 * np.arcsin(min(sine, 1.0)) / sine
    between[3], between[4], between[5] = angle * s0, angle * s1, angle * s2
    for k in range(size):
        between[6 + k] = out[12 + k] - whole[12 + k]
    total = 0.0
    for k in range(6 + size):
        ahead = AHEAD * (out[start + k] - whole[start + k])
        total += c.spread[k] * (between[k] * between[k] + ahead * ahead)
    for axis in range(3):
        out[axis] += between[axis]
    rotate(out, between, 3)
    for k in range(size):
        out[12 + k] += between[6 + k]
    if pushed:
        out[12 + size] += out[12 + size] - whole[12 + size]
    for k in range(start, start + 6 + size + (1 if pushed else 0)):
        out[k] += out[k] - whole[k]
    return np.sqrt(total)


@compiled
@no_type_check
def _step(c, b, z, pushed, time, step, out, work):
    """The state after a step of second order from a time on; returns its error in m."""
    size = c.eigenvalues.shape[1]
    chosen, gaps, what, jacobian, springs, away, whole, half, rows, matrix, known = work
    floor, count = find_near(c, b, z, size, pushed, step, chosen, gaps, what, known)
    good, begin = True, z
    # a whole step, its first half with the same contacts, and the second; one call, or compiling takes longer
    for part in range(3):
        if part != 1:
            linearise(c, b, begin, size, pushed, chosen, what, floor, count, jacobian, gaps, known, part == 0)
            if len(away) > 0:
                linearise_hold(c, b, begin, size, springs, away)
        length, end = (0.5 * step, half) if part else (step, whole)
        if part == 2:
            end = out
        last = time + (0.5 * step if part == 1 else step)
        good &= _implicit(
            c,
            b,
            begin,
            size,
            pushed,
            length,
            last,
            chosen,
            floor,
            count,
            jacobian,
            gaps,
            springs,
            away,
            rows,
            matrix,
            end,
        )
        if part == 1:
            begin = half
    if not good:
        for k in range(len(out)):
            out[k] = np.nan
        return np.nan
    return second_order(c, size, pushed, whole, out)


@compiled
@no_type_check
def slope_between(z, after, size, pushed, step, out):
    """The slope of the state after a step: its velocities, and their mean rate over the step."""
    start = 13 + size
    for axis in range(3):
        out[axis] = after[start + axis]
    w0, w1, w2 = after[start + 3], after[start + 4], after[start + 5]
    for column in range(3):
        r0, r1, r2 = after[3 + column], after[6 + column], after[9 + column]
        out[3 + column], out[6 + column], out[9 + column] = w1 * r2 - w2 * r1, w2 * r0 - w0 * r2, w0 * r1 - w1 * r0
    for k in range(size):
        out[12 + k] = after[start + 6 + k]
    out[12 + size] = after[start + 6 + size] if pushed else 0.0
    for k in range(start, start + 6 + size + (1 if pushed else 0)):
        out[k] = (after[k] - z[k]) / step
    if not pushed:
        out[start + 6 + size] = 0.0


@compiled
@no_type_check
def _work(c):
    """Room for a step."""
    size = c.eigenvalues.shape[1]
    state, width = 20 + 2 * size, 7 + size
    most = c.most * (1 + c.obstacles.shape[1]) + PUSH
    return (
        np.empty(most, np.int64),
        np.empty(max(c.points.shape[2], most)),
        np.empty(most, np.int64),
        np.empty((most, 3, width)),
        np.empty((c.hold_points.shape[2], 3, width)),
        np.empty(3 * c.hold_points.shape[2]),
        np.empty(state),
        np.empty(state),
        room(width, 3 * (most + c.hold_points.shape[2])),
        np.empty((width, width)),
        np.empty((c.points.shape[2], 12)),
    )


@compiled
@no_type_check
def advance_all(c, rows, times, states, steps, out, slopes, errors):
    """States (R, 20 + 2 K) of the pushes `rows` (R,) after `steps` (R,) s, slopes there, and errors (R,) in m.

    The end of the pulse ends a step.
    """
    work, middle = _work(c), np.empty(states.shape[1])
    for row in range(len(rows)):
        errors[row] = _advance(c, rows[row], times[row], states[row], steps[row], out[row], slopes[row], middle, work)


@compiled
@no_type_check
def _advance(c, b, time, state, step, after, slope, middle, work):
    """The state after a step, and the slope there; returns the error in m."""
    error, size = 0.0, c.eigenvalues.shape[1]
    left = min(max(c.pulse - time, 0.0), step)
    copy(state, after)
    for pushed in (True, False):
        length = left if pushed else step - left
        if length > SHORTEST or not (pushed or left > SHORTEST):
            copy(after, middle)
            begin = time if pushed else time + left
            error += _step(c, b, middle, pushed, begin, length, after, work)
            slope_between(middle, after, size, pushed, length, slope)
    return error


@compiled
@no_type_check
def follow(c, b, control, times, states, slopes, rates, tried):
    """Take steps of one motion from node 0 on, under the control of `odeform.solver.integrate`: how many nodes (N,)
    there are then, up to as many as there is room for.

    `control` has the end in s, the tolerance in m, how many steps may be tried in all, the smallest and the largest
    factor on a step, the safety, and three exponents; `rates` the length of the next step and the last ratio of error
    and tolerance; `tried` how many steps were taken and rejected.
    """
    until, tolerance, most, shrink, grow, safety, retried, first, second = control
    size = states.shape[1]
    work, middle, after, slope = _work(c), np.empty(size), np.empty(size), np.empty(size)
    count, longest = 1, grow
    while times[count - 1] < until and count < len(times) and tried[0] + tried[1] < most:
        time, step = times[count - 1], rates[0]
        if time + step <= time:
            break
        error = _advance(c, b, time, states[count - 1], step, after, slope, middle, work)
        if time < c.patch_pulse and step > LONGEST * c.patch_pulse:
            error = np.inf
        ratio = abs(error) / tolerance
        if not ratio <= 1.0:
            if not np.isfinite(ratio):
                ratio = 1e6
            rates[0] = step * max(shrink, safety * ratio**retried)
            tried[1] += 1
            longest = 1.0
            continue
        ratio = max(ratio, 1e-10)
        factor = safety * ratio**first * rates[1] ** second
        rates[0] = step * min(longest, max(shrink, factor))
        rates[1], longest = max(ratio, 1e-4), grow
        copy(after, states[count])
        copy(slope, slopes[count])
        times[count] = time + step
        tried[0] += 1
        count += 1
    return count


@compiled
@no_type_check
def slope_of(c, rows, times, states, out):
    """The slopes (R, 20 + 2 K) of states of the pushes `rows` (R,) at `times` (R,) s."""
    size = c.eigenvalues.shape[1]
    chosen, gaps, what, jacobian, springs, away, _, _, _, matrix, known = _work(c)
    start = 13 + size
    for row in range(len(rows)):
        b, z, pushed = rows[row], states[row], times[row] < c.pulse
        width = 6 + size + (1 if pushed else 0)
        floor, count = find_near(c, b, z, size, pushed, 0.0, chosen, gaps, what, known)
        linearise(c, b, z, size, pushed, chosen, what, floor, count, jacobian, gaps, known, True)
        v, momentum, rate = np.empty(width), np.empty(width), np.empty(width)
        local_velocity(z, size, v)
        free_motion(c, b, z, size, pushed, times[row], v, momentum, rate)
        for k in range(size):
            rate[6 + k] -= c.relaxation * c.eigenvalues[b, k] * v[6 + k]
        linearise_hold(c, b, z, size, springs, away)
        for j in range(len(away)):
            i, axis = j // 3, j % 3
            pull = c.hold_stiffness[b, i] * (away[j] + c.hold_damping * along(springs, i, axis, v))
            for k in range(width):
                rate[k] -= pull * springs[i, axis, k]
        for j in range(count):
            i, r0 = chosen[j], along(jacobian, j, 0, v)
            r1, r2 = along(jacobian, j, 1, v), along(jacobian, j, 2, v)
            force = c.stiffness[b, i] * (-gaps[j] - (c.floor_damping if j < floor else c.push_damping) * r0)
            if force <= 0.0 or (j < floor and gaps[j] + c.onset * r0 > 0.0):
                continue
            drag = drag_of(c.floor_friction if j < floor else c.push_friction, c.grip[b, i], force, r1, r2)
            for k in range(width):
                rate[k] += force * jacobian[j, 0, k] - drag * (r1 * jacobian[j, 1, k] + r2 * jacobian[j, 2, k])
        set_masses(c, b, size, pushed, 0.0, matrix)
        if not solve(matrix, rate):
            for k in range(width):
                rate[k] = np.nan
        slope_between(z, z, size, pushed, 1.0, out[row])
        for part in range(0, 6, 3):
            for axis in range(3):
                out[row, start + part + axis] = (
                    z[3 + 3 * axis] * rate[part] + z[4 + 3 * axis] * rate[part + 1] + z[5 + 3 * axis] * rate[part + 2]
                )
        for k in range(6, width):
            out[row, start + k] = rate[k]
