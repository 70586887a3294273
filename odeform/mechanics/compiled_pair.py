"""The step in time of `odeform.mechanics.pair.PairSteps` as machine code.

The formulas are those of the NumPy code, which is the reference and says what they mean; the tests compare both to
rounding. What each body does by itself is that of `compiled_push`.
"""

from typing import NamedTuple, no_type_check

import numpy as np
from numpy import ndarray

from odeform.compiling import compiled_with
from odeform.mechanics import compiled_push as one_body
from odeform.mechanics.compiled_algebra import add_squares, room, solve
from odeform.mechanics.compiled_contacts import (
    MARGIN,
    bend,
    copy,
    find_near,
    keep,
    linearise,
    move_along,
    turn,
    turn_sample,
)
from odeform.mechanics.compiled_forces import (
    along,
    drag_of,
    free_motion,
    local_velocity,
    move,
    press,
    resist,
    set_masses,
)
from odeform.mechanics.compiled_push import second_order, slope_between

__all__ = ["Between", "advance_pair"]

compiled = compiled_with(__file__, one_body.__file__, *one_body.SOURCES)


class Between(NamedTuple):
    """Holds what stays the same of two like bodies that meet, besides `Constants`."""

    values: ndarray  # (X, Y, Z, 4), as in `odeform.mechanics.inside.Inside`
    owners: ndarray  # (X, Y, Z)
    origin: ndarray  # (3,) m
    cell: float  # m
    stiffness: ndarray  # (S,) N/m of each sample
    grip: ndarray  # (S,) N s/m


@compiled
@no_type_check
def _carry(c, b, z, size, i, motion, memo):
    """Sees to it that `memo` knows where sample i is and how it has turned; `motion` is room."""
    known, where, turns = memo
    if not known[b, i]:
        known[b, i] = True
        turn(c.rows[b], i, z, size, motion)
        square, once, twice = bend(c.points[b], i, motion, where[b, i])
        turn_sample(motion, square, once, twice, turns[b, i])


@compiled
@no_type_check
def _memo(c):
    """What is known of the samples of both bodies: nothing yet."""
    samples = c.points.shape[2]
    return np.zeros((2, samples), np.bool_), np.empty((2, samples, 3)), np.empty((2, samples, 3, 3))


@compiled
@no_type_check
def _inside(c, s, b, z, size, at, back, motion, memo, normal):
    """The signed distance of a place from a body, in its axes, and the sample that carries it; sets the normal there.
    `back` and `motion` are room."""
    points, owner, (_, where, turns) = c.points[b], 0, memo
    for axis in range(3):
        back[axis] = at[axis]
    for _ in range(2):
        i0 = int(np.floor(_cells(s, back[0], 0) + 0.5))
        i1 = int(np.floor(_cells(s, back[1], 1) + 0.5))
        i2 = int(np.floor(_cells(s, back[2], 2) + 0.5))
        owner = s.owners[i0, i1, i2]
        _carry(c, b, z, size, owner, motion, memo)
        place, turned = where[b, owner], turns[b, owner]
        d0, d1, d2 = at[0] - place[0], at[1] - place[1], at[2] - place[2]
        for axis in range(3):
            back[axis] = points[axis, owner] + turned[0, axis] * d0 + turned[1, axis] * d1 + turned[2, axis] * d2
    x, y, w = _cells(s, back[0], 0), _cells(s, back[1], 1), _cells(s, back[2], 2)
    b0, b1, b2 = (
        back[0] - (s.origin[0] + s.cell * x),
        back[1] - (s.origin[1] + s.cell * y),
        back[2] - (s.origin[2] + s.cell * w),
    )
    away = np.sqrt(b0 * b0 + b1 * b1 + b2 * b2)
    i0 = min(int(x), s.owners.shape[0] - 2)
    i1 = min(int(y), s.owners.shape[1] - 2)
    i2 = min(int(w), s.owners.shape[2] - 2)
    gap, s0, s1, s2 = 0.0, 0.0, 0.0, 0.0
    for k0 in range(2):
        w0 = x - i0 if k0 else 1.0 - (x - i0)
        for k1 in range(2):
            w1 = w0 * (y - i1 if k1 else 1.0 - (y - i1))
            for k2 in range(2):
                weight = w1 * (w - i2 if k2 else 1.0 - (w - i2))
                value = s.values[i0 + k0, i1 + k1, i2 + k2]
                gap += weight * value[0]
                s0 += weight * value[1]
                s1 += weight * value[2]
                s2 += weight * value[3]
    turned = turns[b, owner]
    scale = 1.0 / max(np.sqrt(s0 * s0 + s1 * s1 + s2 * s2), 1e-9)
    for axis in range(3):
        normal[axis] = scale * (turned[axis, 0] * s0 + turned[axis, 1] * s1 + turned[axis, 2] * s2)
    return gap + away, owner


@compiled
@no_type_check
def _cells(s, value, axis):
    """Where a coordinate is on the grid, in cells, within it."""
    return min(max((value - s.origin[axis]) / s.cell, 0.0), s.owners.shape[axis] - 1.0)


@compiled
@no_type_check
def _seen(place, z, other, out):
    """A place of one body in axes of the other one."""
    d = (
        z[3] * place[0] + z[4] * place[1] + z[5] * place[2] + (z[0] - other[0]),
        z[6] * place[0] + z[7] * place[1] + z[8] * place[2] + (z[1] - other[1]),
        z[9] * place[0] + z[10] * place[1] + z[11] * place[2] + (z[2] - other[2]),
    )
    for axis in range(3):
        out[axis] = other[3 + axis] * d[0] + other[6 + axis] * d[1] + other[9 + axis] * d[2]


@compiled
@no_type_check
def _extent(c, b, z, size):
    """How far a sample is from the mass centre at most, as the body is deformed."""
    most, extent = 0.0, 0.0
    for k in range(size):
        most += z[12 + k] * z[12 + k]
    for i in range(c.points.shape[2]):
        extent = max(extent, c.extents[b, i])
    return c.reach + np.sqrt(most) * extent


@compiled
@no_type_check
def _met(c, s, states, size, step, chosen, gaps):
    """Choose the samples of each body that may touch the other one in a step: how many of the first, and of both."""
    speed, spin, start, first, count = 0.0, 0.0, 13 + size, 0, 0
    for axis in range(3):
        speed += (states[0, start + axis] - states[1, start + axis]) ** 2
    for b in range(2):
        z = states[b]
        spin += np.sqrt(z[start + 3] * z[start + 3] + z[start + 4] * z[start + 4] + z[start + 5] * z[start + 5])
    margin = MARGIN + 2.0 * step * (np.sqrt(speed) + c.reach * spin)
    extents = (_extent(c, 0, states[0], size), _extent(c, 1, states[1], size))
    apart = 0.0
    for axis in range(3):
        apart += (states[0, axis] - states[1, axis]) ** 2
    if np.sqrt(apart) >= extents[0] + extents[1] + margin:
        return 0, 0
    motion, place, at, back = np.empty(6), np.empty(3), np.empty(3), np.empty(3)
    memo, normal = _memo(c), np.empty(3)
    where = memo[1]
    for b in range(2):
        z, other, begin = states[b], states[1 - b], count
        limit, loose = (extents[1 - b] + margin) ** 2, extents[1 - b] + margin + extents[b] - c.reach
        for i in range(c.points.shape[2]):
            # most samples are so far away that their displacement need not be known
            for axis in range(3):
                place[axis] = c.points[b, axis, i]
            _seen(place, z, other, at)
            if at[0] * at[0] + at[1] * at[1] + at[2] * at[2] >= loose * loose:
                continue
            _carry(c, b, z, size, i, motion, memo)
            _seen(where[b, i], z, other, at)
            if at[0] * at[0] + at[1] * at[1] + at[2] * at[2] >= limit:
                continue
            gap, _ = _inside(c, s, 1 - b, other, size, at, back, motion, memo, normal)
            gaps[i] = gap
            if gap < margin:
                count = keep(chosen, begin, count, c.most, gaps, i)
        if b == 0:
            first = count
    return first, count


@compiled
@no_type_check
def _between(c, s, states, size, chosen, first, count, jacobian, gaps):
    """Linearise the chosen contacts of the bodies with each other about a state."""
    motion, at, back, normal, axes = np.empty(6), np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    memo, width = _memo(c), 6 + size
    _, where, turns = memo
    for j in range(count):
        b, i = (0 if j < first else 1), chosen[j]
        z, other = states[b], states[1 - b]
        _carry(c, b, z, size, i, motion, memo)
        place, own = where[b, i], turns[b, i]
        _seen(place, z, other, at)
        gaps[j], owner = _inside(c, s, 1 - b, other, size, at, back, motion, memo, normal)
        turned = turns[1 - b, owner]
        n0 = other[3] * normal[0] + other[4] * normal[1] + other[5] * normal[2]
        n1 = other[6] * normal[0] + other[7] * normal[1] + other[8] * normal[2]
        n2 = other[9] * normal[0] + other[10] * normal[1] + other[11] * normal[2]
        sign = np.copysign(1.0, n0)
        scale, half = sign / abs(n0 + sign), (n0 + sign, n1, n2)
        for row in range(3):
            for axis in range(3):
                axes[row, axis] = scale * half[row] * half[axis] - (sign if row == axis else 0.0)
            a0, a1, a2 = axes[row, 0], axes[row, 1], axes[row, 2]
            move_along(
                z[3] * a0 + z[6] * a1 + z[9] * a2,
                z[4] * a0 + z[7] * a1 + z[10] * a2,
                z[5] * a0 + z[8] * a1 + z[11] * a2,
                place, own, c.rows[b], i, size, jacobian, j, row, b * width,
            )  # fmt: skip
            move_along(
                -(other[3] * a0 + other[6] * a1 + other[9] * a2),
                -(other[4] * a0 + other[7] * a1 + other[10] * a2),
                -(other[5] * a0 + other[8] * a1 + other[11] * a2),
                at, turned, c.rows[1 - b], owner, size, jacobian, j, row, (1 - b) * width,
            )  # fmt: skip


@compiled
@no_type_check
def _implicit(c, s, states, size, step, end, work, first, count, floors, out):
    """The states of both after one step of first order; false where it cannot be solved for."""
    chosen, gaps, _, jacobian, met, distances, rows, _, _, matrix, _, own, common, _ = work
    width = 6 + size
    v, momentum, rate, right = np.empty(2 * width), np.empty(2 * width), np.empty(2 * width), np.empty(2 * width)
    for b in range(2):
        some = slice(b * width, (b + 1) * width)
        local_velocity(states[b], size, v[some])
        free_motion(c, b, states[b], size, False, end, v[some], momentum[some], rate[some])
    for k in range(2 * width):
        momentum[k] += step * rate[k]
    time, none = step + c.floor_damping, (np.empty((0, 3, width)), np.empty(0))
    for _ in range(2):
        for b in range(2):
            some = slice(b * width, (b + 1) * width)
            set_masses(c, b, size, False, step * (step + c.relaxation), matrix[some, some])
        for i in range(width, 2 * width):
            for k in range(width):
                matrix[i, k] = 0.0
        copy(momentum, right)
        for b in range(2):
            some = slice(b * width, (b + 1) * width)
            resist(
                c, b, step, v[some], chosen[b], floors[b], floors[b], jacobian[b], gaps[b], none[0], none[1],
                own, matrix[some, some], right[some],
            )  # fmt: skip
        pressed = 0
        for j in range(count):
            i, r0 = met[j], along(rows, j, 0, v)
            force = s.stiffness[i] * (-distances[j] - time * r0)
            if force <= 0.0 or distances[j] + step * r0 > 0.0:
                continue
            active = step * s.stiffness[i]
            drag = step * drag_of(c.floor_friction, s.grip[i], force, along(rows, j, 1, v), along(rows, j, 2, v))
            pressed = press(rows, j, time * active, drag, -active * distances[j], common, pressed, right)
        if pressed:
            add_squares(common, pressed, matrix)
            good = solve(matrix, right)
        else:  # each by itself, which takes a quarter of the time
            good = solve(matrix[:width, :width], right[:width]) and solve(matrix[width:, width:], right[width:])
        if not good:
            return False
        copy(right, v)
    for b in range(2):
        move(states[b], v[b * width : (b + 1) * width], size, False, step, out[b])
    return True


@compiled
@no_type_check
def _work(c):
    """Room for a step."""
    size, samples = c.eigenvalues.shape[1], c.points.shape[2]
    state, width, most = 20 + 2 * size, 6 + size, c.most
    return (
        np.empty((2, most), np.int64),
        np.empty((2, max(samples, most))),
        np.empty(most, np.int64),
        np.empty((2, most, 3, width)),
        np.empty(2 * most, np.int64),
        np.empty(max(samples, 2 * most)),
        np.empty((2 * most, 3, 2 * width)),
        np.empty((2, state)),
        np.empty((2, state)),
        np.empty((2 * width, 2 * width)),
        np.empty(2, np.int64),
        room(width, 3 * most),
        room(2 * width, 6 * most),
        np.empty((2, samples, 12)),
    )


@compiled
@no_type_check
def advance_pair(c, s, time, states, step, out, slopes):
    """States (2, 20 + 2 K) of both after a step of `step` s, slopes there; returns the error in m."""
    size = c.eigenvalues.shape[1]
    chosen, gaps, what, jacobian, met, distances, rows, whole, half, _, floors, _, _, known = work = _work(c)
    for b in range(2):
        floors[b], _ = find_near(c, b, states[b], size, False, step, chosen[b], gaps[b], what, known[b])
    first, count = _met(c, s, states, size, step, met, distances)
    good, begin = True, states
    # a whole step, its first half with the same contacts, and the second
    for part in range(3):
        if part != 1:
            for b in range(2):
                linearise(
                    c, b, begin[b], size, False, chosen[b], what, floors[b], floors[b], jacobian[b], gaps[b],
                    known[b], part == 0,
                )  # fmt: skip
            _between(c, s, begin, size, met, first, count, rows, distances)
        length, end = (0.5 * step, half) if part else (step, whole)
        if part == 2:
            end = out
        last = time + (0.5 * step if part == 1 else step)
        good &= _implicit(c, s, begin, size, length, last, work, first, count, floors, end)
        if part == 1:
            begin = half
    error = 0.0
    for b in range(2):
        if not good:
            for k in range(out.shape[1]):
                out[b, k] = np.nan
        error = max(error, second_order(c, size, False, whole[b], out[b]))
        slope_between(states[b], out[b], size, False, step, slopes[b])
    return error if good else np.nan
