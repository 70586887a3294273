"""Where a body is, and what may touch it, as machine code: states (20 + 2 K,) are those of `odeform.mechanics.flat`.

The formulas are those of the NumPy code, which is the reference and says what they mean; the tests compare both to
rounding. Loops in place of arrays save what leads there: the overhead of some hundred small array operations a step.
"""

from typing import NamedTuple, no_type_check

import numpy as np
from numpy import ndarray

from odeform.compiling import compiled_with

__all__ = [
    "Constants",
    "bend",
    "copy",
    "find_near",
    "keep",
    "linearise",
    "linearise_hold",
    "move_along",
    "turn",
    "turn_sample",
]

MARGIN = 1e-3
PUSH = 64
SERIES = 0.25

compiled = compiled_with(__file__)
inlined = compiled_with(__file__, inline=True)


class Constants(NamedTuple):
    """Holds what stays the same over the motions of B pushes of one body, in K directions with S samples."""

    points: ndarray  # (B, 3, S) m
    rows: ndarray  # (B, 6, S, K)
    extents: (
        ndarray  # (B, S) m per root kg m: no sample is displaced by more than that times the norm of all amplitudes
    )
    stiffness: ndarray  # (B, S) N/m of each sample
    grip: ndarray  # (B, S) N s/m
    level: ndarray  # (F,) m of the first F samples, which may touch the floor
    eigenvalues: ndarray  # (B, K) 1/s^2
    preload: ndarray  # (B, K)
    inertia: ndarray  # (3, 3) kg m^2
    spread: ndarray  # (6 + K,) m^2
    centres: ndarray  # (B, 3) m
    guides: ndarray  # (B, 3)
    forces: ndarray  # (B,) N
    mass: float  # kg
    gravity: float  # m/s^2
    relaxation: float  # s
    floor_damping: float  # s
    floor_friction: float
    push_damping: float  # s
    push_friction: float
    radius: float  # m
    projectile: float  # kg
    reach: float  # m, of the farthest sample from the mass centre
    pulse: float  # s
    onset: float  # s: the floor acts on what would be in contact after that time
    most: int  # contacts with the floor, and with each obstacle, that are followed
    obstacles: ndarray  # (B, O, 6, 3), as in `odeform.mechanics.obstacles.Obstacles`
    patch_points: ndarray  # (B, 3) m
    patch_rows: ndarray  # (B, 6, K)
    patch_forces: ndarray  # (B, 3) N
    patch_pulse: float  # s, 0 without a patch
    hold_points: ndarray  # (B, 3, H) m, with H = 0 for bodies that nothing holds
    hold_rows: ndarray  # (B, 6, H, K)
    hold_stiffness: ndarray  # (B, H) N/m
    hold_places: ndarray  # (B, H, 3) m
    hold_damping: float  # s


@inlined
@no_type_check
def copy(source, out):
    """Copies in a loop: assignments to slices take seconds to compile."""
    for k in range(len(out)):
        out[k] = source[k]


@inlined
@no_type_check
def turn(rows, i, z, size, out):
    """Displacement (3) and rotation (3) of sample i by the amplitudes of a state."""
    for axis in range(6):
        total = 0.0
        for k in range(size):
            total += rows[axis, i, k] * z[12 + k]
        out[axis] = total


@inlined
@no_type_check
def _sines(square):
    """sin(a) / a, (1 - cos(a)) / a^2 and (1 - sin(a) / a) / a^2 of an angle by its square: to rounding, its series
    take a tenth of the time of sines."""
    if square < SERIES:
        s = square
        rest = 1.0 / 6227020800.0 - s / 1307674368000.0
        rest = 1.0 / 120.0 - s * (1.0 / 5040.0 - s * (1.0 / 362880.0 - s * (1.0 / 39916800.0 - s * rest)))
        rest = 1.0 / 6.0 - s * rest
        twice = 1.0 / 479001600.0 - s / 87178291200.0
        twice = 1.0 / 24.0 - s * (1.0 / 720.0 - s * (1.0 / 40320.0 - s * (1.0 / 3628800.0 - s * twice)))
        return 1.0 - s * rest, 0.5 - s * twice, rest
    angle = np.sqrt(square)
    half = np.sin(0.5 * angle) / angle
    once = np.sin(angle) / angle
    return once, 2.0 * half * half, (1.0 - once) / square


@inlined
@no_type_check
def bend(points, i, motion, place):
    """Returns where the sample is, and three factors of its rotation: see `odeform.mechanics.warping`."""
    t0, t1, t2 = motion[3], motion[4], motion[5]
    square = t0 * t0 + t1 * t1 + t2 * t2
    once, twice, rest = _sines(square)
    d0, d1, d2 = motion[0], motion[1], motion[2]
    along = (t0 * d0 + t1 * d1 + t2 * d2) * rest
    place[0] = points[0, i] + once * d0 + twice * (t1 * d2 - t2 * d1) + along * t0
    place[1] = points[1, i] + once * d1 + twice * (t2 * d0 - t0 * d2) + along * t1
    place[2] = points[2, i] + once * d2 + twice * (t0 * d1 - t1 * d0) + along * t2
    return square, once, twice


@compiled
@no_type_check
def _centre(c, b, z, size, out):
    """The middle of the sphere from the mass centre, in axes of the body."""
    way = z[12 + size]
    d0 = c.centres[b, 0] + way * c.guides[b, 0] - z[0]
    d1 = c.centres[b, 1] + way * c.guides[b, 1] - z[1]
    d2 = c.centres[b, 2] + way * c.guides[b, 2] - z[2]
    for axis in range(3):
        out[axis] = z[3 + axis] * d0 + z[6 + axis] * d1 + z[9 + axis] * d2


@compiled
@no_type_check
def _met(box, z, place, local, normal):
    """The signed distance of a place in axes of the body from a box, whose outward normal is set in axes of the
    body; `local` is room for three numbers."""
    p0 = z[3] * place[0] + z[4] * place[1] + z[5] * place[2] + z[0] - box[0, 0]
    p1 = z[6] * place[0] + z[7] * place[1] + z[8] * place[2] + z[1] - box[0, 1]
    p2 = z[9] * place[0] + z[10] * place[1] + z[11] * place[2] + z[2] - box[0, 2]
    square, deepest, nearest = 0.0, -np.inf, 0
    for axis in range(3):
        x = box[1 + axis, 0] * p0 + box[1 + axis, 1] * p1 + box[1 + axis, 2] * p2
        below, above = box[4, axis] - x, x - box[5, axis]
        beyond = max(below, above)
        if beyond > deepest:
            deepest, nearest = beyond, axis
        outside = max(beyond, 0.0)
        square += outside * outside
        local[axis] = outside if above >= below else -outside
    distance = np.sqrt(square)
    if deepest <= 0.0:
        distance = deepest
        x = box[1 + nearest, 0] * p0 + box[1 + nearest, 1] * p1 + box[1 + nearest, 2] * p2
        for axis in range(3):
            local[axis] = 0.0
        local[nearest] = 1.0 if x - box[5, nearest] >= box[4, nearest] - x else -1.0
    else:
        for axis in range(3):
            local[axis] /= distance
    n0 = local[0] * box[1, 0] + local[1] * box[2, 0] + local[2] * box[3, 0]
    n1 = local[0] * box[1, 1] + local[1] * box[2, 1] + local[2] * box[3, 1]
    n2 = local[0] * box[1, 2] + local[1] * box[2, 2] + local[2] * box[3, 2]
    for axis in range(3):
        normal[axis] = z[3 + axis] * n0 + z[6 + axis] * n1 + z[9 + axis] * n2
    return distance


@compiled
@no_type_check
def _near_obstacles(c, b, z, size, step, most, floor, chosen, gaps, what, known):
    """Choose the samples that may touch an obstacle in a step, after those of the floor: how many in all by now."""
    points, rows, v = c.points[b], c.rows[b], 13 + size
    motion, place, local, normal = np.empty(6), np.empty(3), np.empty(3), np.empty(3)
    spin = np.sqrt(z[v + 3] * z[v + 3] + z[v + 4] * z[v + 4] + z[v + 5] * z[v + 5])
    speed = np.sqrt(z[v] * z[v] + z[v + 1] * z[v + 1] + z[v + 2] * z[v + 2])
    ahead, count, extent = 2.0 * step + c.floor_damping, floor, 0.0
    farthest = MARGIN + ahead * (speed + spin * c.reach)
    for i in range(len(c.level)):
        extent = max(extent, c.extents[b, i])
    v0 = z[3] * z[v] + z[6] * z[v + 1] + z[9] * z[v + 2]
    v1 = z[4] * z[v] + z[7] * z[v + 1] + z[10] * z[v + 2]
    v2 = z[5] * z[v] + z[8] * z[v + 1] + z[11] * z[v + 2]
    for number in range(c.obstacles.shape[1]):
        box, first = c.obstacles[b, number], count
        for axis in range(3):
            place[axis] = 0.0
        # all of the body may be so far away that its samples need not be looked at
        if _met(box, z, place, local, normal) - c.reach - most * extent >= farthest:
            continue
        for i in range(len(c.level)):
            for axis in range(3):
                place[axis] = points[axis, i]
            if _met(box, z, place, local, normal) - most * c.extents[b, i] >= farthest:
                continue
            turn(rows, i, z, size, motion)
            square, once, twice = bend(points, i, motion, place)
            _store(known, i, motion, place, square, once, twice)
            gaps[i] = _met(box, z, place, local, normal)
            towards = min(normal[0] * v0 + normal[1] * v1 + normal[2] * v2 - c.reach * spin, 0.0)
            if gaps[i] < MARGIN - ahead * towards:
                count = keep(chosen, first, count, c.most, gaps, i)
        for j in range(first, count):
            what[j] = number
    return count


@compiled
@no_type_check
def keep(chosen, first, count, most, gaps, i):
    """Add sample i to at most `most` chosen from `first` on, or in place of the one with the largest gap, which is
    always the first of them: they are a heap."""
    if count - first < most:
        at = count - first
        while at > 0 and gaps[chosen[first + (at - 1) // 2]] < gaps[i]:
            chosen[first + at] = chosen[first + (at - 1) // 2]
            at = (at - 1) // 2
        chosen[first + at] = i
        return count + 1
    if gaps[i] >= gaps[chosen[first]]:
        return count
    at, below = 0, 1
    while below < most:
        if below + 1 < most and gaps[chosen[first + below + 1]] > gaps[chosen[first + below]]:
            below += 1
        if gaps[chosen[first + below]] <= gaps[i]:
            break
        chosen[first + at] = chosen[first + below]
        at, below = below, 2 * below + 1
    chosen[first + at] = i
    return count


@compiled
@no_type_check
def find_near(c, b, z, size, pushed, step, chosen, gaps, what, known):
    """Choose the samples that may touch something in a step: how many on the floor and obstacles, and how many in
    all. Where each of them is, is then `known`, (S, 12)."""
    points, rows, v = c.points[b], c.rows[b], 13 + size
    motion, place, centre = np.empty(6), np.empty(3), np.empty(3)
    spin = np.sqrt(z[v + 3] * z[v + 3] + z[v + 4] * z[v + 4] + z[v + 5] * z[v + 5])
    down = min(z[v + 2] - spin * c.reach, 0.0)
    margin = MARGIN - (2.0 * step + c.floor_damping) * down
    floor, most = 0, 0.0
    for k in range(size):
        most += z[12 + k] * z[12 + k]
    most = np.sqrt(most)
    for i in range(len(c.level)):
        # most samples are so far away that their displacement need not be known
        height = z[9] * points[0, i] + z[10] * points[1, i] + z[11] * points[2, i] + z[2] + c.level[i]
        if height - most * c.extents[b, i] >= margin:
            continue
        turn(rows, i, z, size, motion)
        square, once, twice = bend(points, i, motion, place)
        _store(known, i, motion, place, square, once, twice)
        gaps[i] = z[9] * place[0] + z[10] * place[1] + z[11] * place[2] + z[2] + c.level[i]
        if gaps[i] < margin:
            floor = keep(chosen, 0, floor, c.most, gaps, i)
    for j in range(floor):
        what[j] = -1
    if c.obstacles.shape[1]:
        floor = _near_obstacles(c, b, z, size, step, most, floor, chosen, gaps, what, known)
    if not pushed:
        return floor, floor
    _centre(c, b, z, size, centre)
    speed = 0.0
    for axis in range(3):
        own = z[v + 6 + size] * c.guides[b, axis] - z[v + axis]
        speed += own * own
    margin = c.radius + MARGIN + (2.0 * step + c.push_damping) * np.sqrt(speed)
    count = floor
    for i in range(len(c.level), points.shape[1]):
        d0, d1, d2 = points[0, i] - centre[0], points[1, i] - centre[1], points[2, i] - centre[2]
        if np.sqrt(d0 * d0 + d1 * d1 + d2 * d2) - most * c.extents[b, i] >= margin:
            continue
        turn(rows, i, z, size, motion)
        square, once, twice = bend(points, i, motion, place)
        _store(known, i, motion, place, square, once, twice)
        gaps[i] = np.sqrt((place[0] - centre[0]) ** 2 + (place[1] - centre[1]) ** 2 + (place[2] - centre[2]) ** 2)
        if gaps[i] < margin:
            count = keep(chosen, floor, count, PUSH, gaps, i)
    return floor, count


@inlined
@no_type_check
def _store(known, i, motion, place, square, once, twice):
    """Keep where a sample is, for as long as the state is the same."""
    for axis in range(6):
        known[i, axis] = motion[axis]
    for axis in range(3):
        known[i, 6 + axis] = place[axis]
    known[i, 9], known[i, 10], known[i, 11] = square, once, twice


@inlined
@no_type_check
def turn_sample(motion, square, once, twice, turned):
    """Sets the rotation of a sample, once it has moved."""
    t0, t1, t2 = motion[3], motion[4], motion[5]
    rest = 1.0 - twice * square
    turned[0, 0], turned[0, 1] = rest + twice * t0 * t0, twice * t0 * t1 - once * t2
    turned[0, 2] = twice * t0 * t2 + once * t1
    turned[1, 0], turned[1, 1] = twice * t0 * t1 + once * t2, rest + twice * t1 * t1
    turned[1, 2] = twice * t1 * t2 - once * t0
    turned[2, 0], turned[2, 1] = twice * t0 * t2 - once * t1, twice * t1 * t2 + once * t0
    turned[2, 2] = rest + twice * t2 * t2


@inlined
@no_type_check
def move_along(a0, a1, a2, place, turned, rows, i, size, out, j, row, at):
    """Sets how fast sample i moves along an axis of the body, by the velocities: entries of out[j, row] from `at` on.

    Views of rows are made nowhere here: each counts references, which takes longer than some of the sums.
    """
    out[j, row, at], out[j, row, at + 1], out[j, row, at + 2] = a0, a1, a2
    out[j, row, at + 3] = place[1] * a2 - place[2] * a1
    out[j, row, at + 4] = place[2] * a0 - place[0] * a2
    out[j, row, at + 5] = place[0] * a1 - place[1] * a0
    b0 = a0 * turned[0, 0] + a1 * turned[1, 0] + a2 * turned[2, 0]
    b1 = a0 * turned[0, 1] + a1 * turned[1, 1] + a2 * turned[2, 1]
    b2 = a0 * turned[0, 2] + a1 * turned[1, 2] + a2 * turned[2, 2]
    for k in range(size):
        out[j, row, at + 6 + k] = b0 * rows[0, i, k] + b1 * rows[1, i, k] + b2 * rows[2, i, k]


@compiled
@no_type_check
def linearise(c, b, z, size, pushed, chosen, what, floor, count, jacobian, gaps, known, same):
    """Linearise the chosen contacts about a state, in axes of the body; see `odeform.mechanics.touching.Near`. `same`
    says whether it is the state about which samples are `known`."""
    points, rows = c.points[b], c.rows[b]
    motion, place, centre, axes, turned = np.empty(6), np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    guide, local, normal = np.zeros(3), np.empty(3), np.empty(3)
    if pushed:
        _centre(c, b, z, size, centre)
        for axis in range(3):
            guide[axis] = z[3 + axis] * c.guides[b, 0] + z[6 + axis] * c.guides[b, 1] + z[9 + axis] * c.guides[b, 2]
    for j in range(count):
        i = chosen[j]
        if same:
            for axis in range(6):
                motion[axis] = known[i, axis]
            for axis in range(3):
                place[axis] = known[i, 6 + axis]
            square, once, twice = known[i, 9], known[i, 10], known[i, 11]
        else:
            turn(rows, i, z, size, motion)
            square, once, twice = bend(points, i, motion, place)
        if j < floor and what[j] < 0:
            gaps[j] = z[9] * place[0] + z[10] * place[1] + z[11] * place[2] + z[2] + c.level[i]
            for axis in range(3):
                axes[0, axis], axes[1, axis], axes[2, axis] = z[9 + axis], z[3 + axis], z[6 + axis]
        else:
            if j < floor:
                gaps[j] = _met(c.obstacles[b, what[j]], z, place, local, normal)
                n0, n1, n2 = normal[0], normal[1], normal[2]
            else:
                n0, n1, n2 = place[0] - centre[0], place[1] - centre[1], place[2] - centre[2]
                distance = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
                gaps[j] = distance - c.radius
                distance = max(distance, 1e-9)
                n0, n1, n2 = n0 / distance, n1 / distance, n2 / distance
            sign = np.copysign(1.0, n0)
            scale = sign / abs(n0 + sign)
            half = (n0 + sign, n1, n2)
            for row in range(3):
                for axis in range(3):
                    axes[row, axis] = scale * half[row] * half[axis] - (sign if row == axis else 0.0)
        turn_sample(motion, square, once, twice, turned)
        for row in range(3):
            a0, a1, a2 = axes[row, 0], axes[row, 1], axes[row, 2]
            move_along(a0, a1, a2, place, turned, rows, i, size, jacobian, j, row, 0)
            if pushed:
                jacobian[j, row, 6 + size] = 0.0 if j < floor else -(a0 * guide[0] + a1 * guide[1] + a2 * guide[2])


@compiled
@no_type_check
def linearise_hold(c, b, z, size, jacobian, away):
    """Linearise the springs that hold a patch about a state, in axes of the body; see `odeform.mechanics.holding`."""
    width = jacobian.shape[2]
    points, rows, places = c.hold_points[b], c.hold_rows[b], c.hold_places[b]
    motion, place, turned = np.empty(6), np.empty(3), np.empty((3, 3))
    for i in range(points.shape[1]):
        turn(rows, i, z, size, motion)
        square, once, twice = bend(points, i, motion, place)
        turn_sample(motion, square, once, twice, turned)
        d0, d1, d2 = places[i, 0] - z[0], places[i, 1] - z[1], places[i, 2] - z[2]
        for axis in range(3):
            away[3 * i + axis] = place[axis] - (z[3 + axis] * d0 + z[6 + axis] * d1 + z[9 + axis] * d2)
            for k in range(6 + size, width):
                jacobian[i, axis, k] = 0.0
            a0, a1, a2 = (1.0 if axis == 0 else 0.0), (1.0 if axis == 1 else 0.0), (1.0 if axis == 2 else 0.0)
            move_along(a0, a1, a2, place, turned, rows, i, size, jacobian, i, axis, 0)
