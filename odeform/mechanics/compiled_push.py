"""The step in time of `odeform.mechanics.step.Steps` as machine code, one motion after the other.

The formulas are those of the NumPy code, which is the reference and says what they mean; the tests compare both to
rounding. Loops in place of arrays save what leads there: the overhead of some hundred small array operations a step.
"""

from typing import NamedTuple, no_type_check

import numpy as np
from numpy import ndarray

from odeform.compiling import compiled_with
from odeform.mechanics import compiled_algebra
from odeform.mechanics.compiled_algebra import add_squares, room, solve

__all__ = ["Constants", "advance_all", "follow", "slope_of"]

MARGIN = 1e-3
SLIP = 1e-4
AHEAD = 0.02
PUSH = 64
SHORTEST = 1e-9
SMALL = 1e-18
LONGEST = 0.25

compiled = compiled_with(__file__, compiled_algebra.__file__)


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


@compiled
@no_type_check
def _copy(source, out):
    """Copies in a loop: assignments to slices take seconds to compile."""
    for k in range(len(out)):
        out[k] = source[k]


@compiled
@no_type_check
def _turn(rows, i, z, size, out):
    """Displacement (3) and rotation (3) of sample i by the amplitudes of a state."""
    for axis in range(6):
        total = 0.0
        for k in range(size):
            total += rows[axis, i, k] * z[12 + k]
        out[axis] = total


@compiled
@no_type_check
def _bent(points, i, motion, place):
    """Returns where the sample is, and three factors of its rotation: see `odeform.mechanics.warping`."""
    t0, t1, t2 = motion[3], motion[4], motion[5]
    square = t0 * t0 + t1 * t1 + t2 * t2 + SMALL
    angle = np.sqrt(square)
    half = np.sin(0.5 * angle) / angle
    once, twice = np.sin(angle) / angle, 2.0 * half * half
    d0, d1, d2 = motion[0], motion[1], motion[2]
    along = (t0 * d0 + t1 * d1 + t2 * d2) * ((1.0 - once) / square)
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
def _near_obstacles(c, b, z, size, step, most, floor, chosen, gaps, what):
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
            _turn(rows, i, z, size, motion)
            _bent(points, i, motion, place)
            gaps[i] = _met(box, z, place, local, normal)
            towards = min(normal[0] * v0 + normal[1] * v1 + normal[2] * v2 - c.reach * spin, 0.0)
            if gaps[i] < MARGIN - ahead * towards:
                count = _keep(chosen, first, count, c.most, gaps, i)
        for j in range(first, count):
            what[j] = number
    return count


@compiled
@no_type_check
def _keep(chosen, first, count, most, gaps, i):
    """Add sample i to at most `most` chosen from `first` on, or in place of the one with the largest gap."""
    if count - first < most:
        chosen[count] = i
        return count + 1
    worst = first
    for j in range(first + 1, count):
        if gaps[chosen[j]] > gaps[chosen[worst]]:
            worst = j
    if gaps[i] < gaps[chosen[worst]]:
        chosen[worst] = i
    return count


@compiled
@no_type_check
def _near(c, b, z, size, pushed, step, chosen, gaps, what):
    """Choose the samples that may touch something in a step: how many on the floor and obstacles, and how many in
    all."""
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
        _turn(rows, i, z, size, motion)
        _bent(points, i, motion, place)
        gaps[i] = z[9] * place[0] + z[10] * place[1] + z[11] * place[2] + z[2] + c.level[i]
        if gaps[i] < margin:
            floor = _keep(chosen, 0, floor, c.most, gaps, i)
    for j in range(floor):
        what[j] = -1
    if c.obstacles.shape[1]:
        floor = _near_obstacles(c, b, z, size, step, most, floor, chosen, gaps, what)
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
        _turn(rows, i, z, size, motion)
        _bent(points, i, motion, place)
        gaps[i] = np.sqrt((place[0] - centre[0]) ** 2 + (place[1] - centre[1]) ** 2 + (place[2] - centre[2]) ** 2)
        if gaps[i] < margin:
            count = _keep(chosen, floor, count, PUSH, gaps, i)
    return floor, count


@compiled
@no_type_check
def _turned(motion, square, once, twice, turned):
    """Sets the rotation of a sample, once it has moved."""
    t0, t1, t2 = motion[3], motion[4], motion[5]
    rest = 1.0 - twice * square
    turned[0, 0], turned[0, 1] = rest + twice * t0 * t0, twice * t0 * t1 - once * t2
    turned[0, 2] = twice * t0 * t2 + once * t1
    turned[1, 0], turned[1, 1] = twice * t0 * t1 + once * t2, rest + twice * t1 * t1
    turned[1, 2] = twice * t1 * t2 - once * t0
    turned[2, 0], turned[2, 1] = twice * t0 * t2 - once * t1, twice * t1 * t2 + once * t0
    turned[2, 2] = rest + twice * t2 * t2


@compiled
@no_type_check
def _moves(a0, a1, a2, place, turned, rows, i, size, out):
    """Sets how fast sample i moves along an axis of the body, by the velocities."""
    out[0], out[1], out[2] = a0, a1, a2
    out[3] = place[1] * a2 - place[2] * a1
    out[4] = place[2] * a0 - place[0] * a2
    out[5] = place[0] * a1 - place[1] * a0
    b0 = a0 * turned[0, 0] + a1 * turned[1, 0] + a2 * turned[2, 0]
    b1 = a0 * turned[0, 1] + a1 * turned[1, 1] + a2 * turned[2, 1]
    b2 = a0 * turned[0, 2] + a1 * turned[1, 2] + a2 * turned[2, 2]
    r0, r1, r2 = rows[0, i], rows[1, i], rows[2, i]
    for k in range(size):
        out[6 + k] = b0 * r0[k] + b1 * r1[k] + b2 * r2[k]


@compiled
@no_type_check
def _contacts(c, b, z, size, pushed, chosen, what, floor, count, jacobian, gaps):
    """Linearise the chosen contacts about a state, in axes of the body; see `odeform.mechanics.touching.Near`."""
    points, rows = c.points[b], c.rows[b]
    motion, place, centre, axes, turned = np.empty(6), np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    guide, local, normal = np.zeros(3), np.empty(3), np.empty(3)
    if pushed:
        _centre(c, b, z, size, centre)
        for axis in range(3):
            guide[axis] = z[3 + axis] * c.guides[b, 0] + z[6 + axis] * c.guides[b, 1] + z[9 + axis] * c.guides[b, 2]
    for j in range(count):
        i = chosen[j]
        _turn(rows, i, z, size, motion)
        square, once, twice = _bent(points, i, motion, place)
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
        _turned(motion, square, once, twice, turned)
        for row in range(3):
            out = jacobian[j, row]
            _moves(axes[row, 0], axes[row, 1], axes[row, 2], place, turned, rows, i, size, out)
            if pushed:
                out[6 + size] = (
                    0.0 if j < floor else -(axes[row, 0] * guide[0] + axes[row, 1] * guide[1] + axes[row, 2] * guide[2])
                )


@compiled
@no_type_check
def _hold(c, b, z, size, jacobian, away):
    """Linearise the springs that hold a patch about a state, in axes of the body; see `odeform.mechanics.holding`."""
    points, rows, places = c.hold_points[b], c.hold_rows[b], c.hold_places[b]
    motion, place, turned = np.empty(6), np.empty(3), np.empty((3, 3))
    for i in range(points.shape[1]):
        _turn(rows, i, z, size, motion)
        square, once, twice = _bent(points, i, motion, place)
        _turned(motion, square, once, twice, turned)
        d0, d1, d2 = places[i, 0] - z[0], places[i, 1] - z[1], places[i, 2] - z[2]
        for axis in range(3):
            row, out = 3 * i + axis, jacobian[3 * i + axis]
            away[row] = place[axis] - (z[3 + axis] * d0 + z[6 + axis] * d1 + z[9 + axis] * d2)
            for k in range(len(out)):
                out[k] = 0.0
            a0, a1, a2 = (1.0 if axis == 0 else 0.0), (1.0 if axis == 1 else 0.0), (1.0 if axis == 2 else 0.0)
            _moves(a0, a1, a2, place, turned, rows, i, size, out)


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
def _rotate(z, vector, at):
    """Turn the rotation of a state further by the vector that begins `at`, in axes of the scene."""
    w0, w1, w2 = vector[at], vector[at + 1], vector[at + 2]
    angle = np.sqrt(w0 * w0 + w1 * w1 + w2 * w2) + 1e-150
    half = np.sin(0.5 * angle) / angle
    once, twice = np.sin(angle) / angle, 2.0 * half * half
    for column in range(3):
        r0, r1, r2 = z[3 + column], z[6 + column], z[9 + column]
        c0, c1, c2 = w1 * r2 - w2 * r1, w2 * r0 - w0 * r2, w0 * r1 - w1 * r0
        z[3 + column] = r0 + once * c0 + twice * (w1 * c2 - w2 * c1)
        z[6 + column] = r1 + once * c1 + twice * (w2 * c0 - w0 * c2)
        z[9 + column] = r2 + once * c2 + twice * (w0 * c1 - w1 * c0)


@compiled
@no_type_check
def _local(z, size, v):
    """The velocities of a state, shift and spin in axes of the body."""
    start = 13 + size
    for part in range(0, 6, 3):
        s0, s1, s2 = z[start + part], z[start + part + 1], z[start + part + 2]
        for axis in range(3):
            v[part + axis] = z[3 + axis] * s0 + z[6 + axis] * s1 + z[9 + axis] * s2
    for k in range(6, len(v)):
        v[k] = z[start + k]


@compiled
@no_type_check
def _patch(c, b, z, size, time, rate):
    """Add the force on the patch at a time to the rate of the momentum, in axes of the body."""
    motion, place, rows = np.zeros(6), np.empty(3), c.patch_rows[b]
    for axis in range(6):
        for k in range(size):
            motion[axis] += rows[axis, k] * z[12 + k]
    square, once, twice = _bent(c.patch_points[b].reshape(3, 1), 0, motion, place)
    strength = np.sin(np.pi * time / c.patch_pulse) ** 2
    f = np.empty(3)
    for axis in range(3):
        f[axis] = strength * (
            z[3 + axis] * c.patch_forces[b, 0] + z[6 + axis] * c.patch_forces[b, 1] + z[9 + axis] * c.patch_forces[b, 2]
        )
        rate[axis] += f[axis]
    rate[3] += place[1] * f[2] - place[2] * f[1]
    rate[4] += place[2] * f[0] - place[0] * f[2]
    rate[5] += place[0] * f[1] - place[1] * f[0]
    t0, t1, t2 = motion[3], motion[4], motion[5]
    along, rest = twice * (t0 * f[0] + t1 * f[1] + t2 * f[2]), 1.0 - twice * square
    # the force in axes that turn with the patch
    b0 = rest * f[0] + along * t0 - once * (t1 * f[2] - t2 * f[1])
    b1 = rest * f[1] + along * t1 - once * (t2 * f[0] - t0 * f[2])
    b2 = rest * f[2] + along * t2 - once * (t0 * f[1] - t1 * f[0])
    for k in range(size):
        rate[6 + k] += b0 * rows[0, k] + b1 * rows[1, k] + b2 * rows[2, k]


@compiled
@no_type_check
def _free(c, b, z, size, pushed, time, v, momentum, rate):
    """Momentum and its rate at a time without contacts and damping, in axes of the body."""
    inertia = c.inertia
    for axis in range(3):
        momentum[axis] = c.mass * v[axis]
        momentum[3 + axis] = inertia[axis, 0] * v[3] + inertia[axis, 1] * v[4] + inertia[axis, 2] * v[5]
        rate[axis] = -c.mass * c.gravity * z[9 + axis]
    l0, l1, l2 = momentum[3], momentum[4], momentum[5]
    rate[3], rate[4], rate[5] = l1 * v[5] - l2 * v[4], l2 * v[3] - l0 * v[5], l0 * v[4] - l1 * v[3]
    for k in range(size):
        momentum[6 + k] = v[6 + k]
        rate[6 + k] = -c.eigenvalues[b, k] * z[12 + k] - c.preload[b, k]
    if pushed:
        momentum[6 + size] = c.projectile * v[6 + size]
        rate[6 + size] = c.forces[b]
    if 0.0 < time < c.patch_pulse:
        _patch(c, b, z, size, time, rate)


@compiled
@no_type_check
def _masses(c, b, size, pushed, stiff, matrix):
    """Set the lower half of the matrix to the masses, and those of modes to one and `stiff` times their eigenvalues."""
    for i in range(6 + size + (1 if pushed else 0)):
        for k in range(i + 1):
            matrix[i, k] = 0.0
    for axis in range(3):
        matrix[axis, axis] = c.mass
        for other in range(axis + 1):
            matrix[3 + axis, 3 + other] = c.inertia[axis, other]
    for k in range(size):
        matrix[6 + k, 6 + k] = 1.0 + stiff * c.eigenvalues[b, k]
    if pushed:
        matrix[6 + size, 6 + size] = c.projectile


@compiled
@no_type_check
def _along(row, v):
    """A row of the Jacobian times the velocities."""
    total = 0.0
    for k in range(len(v)):
        total += row[k] * v[k]
    return total


@compiled
@no_type_check
def _relative(n, s, t, v):
    """The three rows of a contact times the velocities."""
    r0 = r1 = r2 = 0.0
    for k in range(len(v)):
        r0 += n[k] * v[k]
        r1 += s[k] * v[k]
        r2 += t[k] * v[k]
    return r0, r1, r2


@compiled
@no_type_check
def _drag(c, b, j, i, floor, force, r1, r2):
    """Friction by the speed of sliding under a normal force, N s/m."""
    limit = (c.floor_friction if j < floor else c.push_friction) * force
    return limit / np.sqrt(r1 * r1 + r2 * r2 + (limit / c.grip[b, i]) ** 2 + SLIP * SLIP)


@compiled
@no_type_check
def _resist(c, b, step, v, chosen, floor, count, jacobian, gaps, springs, away, rows, matrix, right):
    """Add the chosen contacts, and the springs that hold it, to the lower half of a matrix and to the momentum, at
    about these velocities."""
    added = len(away)
    for j in range(added):
        row, active = springs[j], step * c.hold_stiffness[b, j // 3]
        rows.weights[j] = active * (step + c.hold_damping)
        for k in range(len(right)):
            rows.columns[k, j] = row[k]
            right[k] -= active * away[j] * row[k]
    for j in range(count):
        n, s, t, i = jacobian[j, 0], jacobian[j, 1], jacobian[j, 2], chosen[j]
        r0, r1, r2 = _relative(n, s, t, v)
        time = step + (c.floor_damping if j < floor else c.push_damping)
        force = c.stiffness[b, i] * (-gaps[j] - time * r0)
        if force <= 0.0 or (j < floor and gaps[j] + (step + c.onset) * r0 > 0.0):
            continue
        active = step * c.stiffness[b, i]
        drag = step * _drag(c, b, j, i, floor, force, r1, r2)
        added = _press(n, s, t, time * active, drag, -active * gaps[j], rows, added, right)
    add_squares(rows, added, matrix)


@compiled
@no_type_check
def _press(n, s, t, normal, drag, impulse, rows, added, right):
    """Add the three rows of a contact to those that resist, and what it adds to the momentum; how many rows there
    are then."""
    columns, weights = rows.columns, rows.weights
    weights[added], weights[added + 1], weights[added + 2] = normal, drag, drag
    for k in range(len(right)):
        column = columns[k]
        column[added], column[added + 1], column[added + 2] = n[k], s[k], t[k]
        right[k] += impulse * n[k]
    return added + 3


@compiled
@no_type_check
def _moved(z, v, size, pushed, step, out):
    """The state after a step with constant velocities, in axes of the body."""
    _copy(z, out)
    start, vector = 13 + size, np.empty(3)
    for axis in range(3):
        r0, r1, r2 = z[3 + 3 * axis], z[4 + 3 * axis], z[5 + 3 * axis]
        speed = r0 * v[0] + r1 * v[1] + r2 * v[2]
        spin = r0 * v[3] + r1 * v[4] + r2 * v[5]
        out[start + axis], out[start + 3 + axis] = speed, spin
        out[axis] += step * speed
        vector[axis] = step * spin
    _rotate(out, vector, 0)
    for k in range(size):
        out[start + 6 + k] = v[6 + k]
        out[12 + k] += step * v[6 + k]
    if pushed:
        out[start + 6 + size] = v[6 + size]
        out[12 + size] += step * v[6 + size]


@compiled
@no_type_check
def _implicit(c, b, z, size, pushed, step, end, chosen, floor, count, jacobian, gaps, springs, away, rows, matrix, out):
    """The state after one step of first order, which ends at a time; false where it cannot be solved for."""
    width = 6 + size + (1 if pushed else 0)
    v, momentum, rate, right = np.empty(width), np.empty(width), np.empty(width), np.empty(width)
    _local(z, size, v)
    _free(c, b, z, size, pushed, end, v, momentum, rate)
    for k in range(width):
        momentum[k] += step * rate[k]
    touches = count > 0 or len(away) > 0
    # where nothing touches it, the second sweep would find the same
    for _ in range(2 if touches else 1):
        _masses(c, b, size, pushed, step * (step + c.relaxation), matrix)
        _copy(momentum, right)
        _resist(c, b, step, v, chosen, floor, count, jacobian, gaps, springs, away, rows, matrix, right)
        if not (solve(matrix, right) if touches else _solve_apart(matrix, right)):
            return False
        for k in range(width):
            v[k] = right[k]
    _moved(z, v, size, pushed, step, out)
    return True


@compiled
@no_type_check
def _second_order(c, size, pushed, whole, out):
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
    _rotate(out, between, 3)
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
    chosen, gaps, what, jacobian, springs, away, whole, half, rows, matrix = work
    floor, count = _near(c, b, z, size, pushed, step, chosen, gaps, what)
    good, begin = True, z
    # a whole step, its first half with the same contacts, and the second; one call, or compiling takes longer
    for part in range(3):
        if part != 1:
            _contacts(c, b, begin, size, pushed, chosen, what, floor, count, jacobian, gaps)
            _hold(c, b, begin, size, springs, away)
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
    return _second_order(c, size, pushed, whole, out)


@compiled
@no_type_check
def _slope(z, after, size, pushed, step, out):
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
        np.empty((3 * c.hold_points.shape[2], width)),
        np.empty(3 * c.hold_points.shape[2]),
        np.empty(state),
        np.empty(state),
        room(width, 3 * (most + c.hold_points.shape[2])),
        np.empty((width, width)),
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
    _copy(state, after)
    for pushed in (True, False):
        length = left if pushed else step - left
        if length > SHORTEST or not (pushed or left > SHORTEST):
            _copy(after, middle)
            begin = time if pushed else time + left
            error += _step(c, b, middle, pushed, begin, length, after, work)
            _slope(middle, after, size, pushed, length, slope)
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
        _copy(after, states[count])
        _copy(slope, slopes[count])
        times[count] = time + step
        tried[0] += 1
        count += 1
    return count


@compiled
@no_type_check
def slope_of(c, rows, times, states, out):
    """The slopes (R, 20 + 2 K) of states of the pushes `rows` (R,) at `times` (R,) s."""
    size = c.eigenvalues.shape[1]
    chosen, gaps, what, jacobian, springs, away, _, _, _, matrix = _work(c)
    start = 13 + size
    for row in range(len(rows)):
        b, z, pushed = rows[row], states[row], times[row] < c.pulse
        width = 6 + size + (1 if pushed else 0)
        floor, count = _near(c, b, z, size, pushed, 0.0, chosen, gaps, what)
        _contacts(c, b, z, size, pushed, chosen, what, floor, count, jacobian, gaps)
        v, momentum, rate = np.empty(width), np.empty(width), np.empty(width)
        _local(z, size, v)
        _free(c, b, z, size, pushed, times[row], v, momentum, rate)
        for k in range(size):
            rate[6 + k] -= c.relaxation * c.eigenvalues[b, k] * v[6 + k]
        _hold(c, b, z, size, springs, away)
        for j in range(len(away)):
            pull = c.hold_stiffness[b, j // 3] * (away[j] + c.hold_damping * _along(springs[j], v))
            for k in range(width):
                rate[k] -= pull * springs[j, k]
        for j in range(count):
            n, s, t, i = jacobian[j, 0], jacobian[j, 1], jacobian[j, 2], chosen[j]
            r0, r1, r2 = _relative(n, s, t, v)
            force = c.stiffness[b, i] * (-gaps[j] - (c.floor_damping if j < floor else c.push_damping) * r0)
            if force <= 0.0 or (j < floor and gaps[j] + c.onset * r0 > 0.0):
                continue
            drag = _drag(c, b, j, i, floor, force, r1, r2)
            for k in range(width):
                rate[k] += force * n[k] - drag * (r1 * s[k] + r2 * t[k])
        _masses(c, b, size, pushed, 0.0, matrix)
        if not solve(matrix, rate):
            for k in range(width):
                rate[k] = np.nan
        _slope(z, z, size, pushed, 1.0, out[row])
        for part in range(0, 6, 3):
            for axis in range(3):
                out[row, start + part + axis] = (
                    z[3 + 3 * axis] * rate[part] + z[4 + 3 * axis] * rate[part + 1] + z[5 + 3 * axis] * rate[part + 2]
                )
        for k in range(6, width):
            out[row, start + k] = rate[k]
