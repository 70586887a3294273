"""What acts on a body, as machine code: momentum, forces, and how contacts resist; see `compiled_contacts`."""

from typing import no_type_check

import numpy as np

from odeform.compiling import compiled_with
from odeform.mechanics import compiled_algebra, compiled_contacts
from odeform.mechanics.compiled_algebra import add_squares
from odeform.mechanics.compiled_contacts import bend, copy

__all__ = [
    "along",
    "drag_of",
    "free_motion",
    "local_velocity",
    "move",
    "press",
    "resist",
    "rotate",
    "set_masses",
]

SLIP = 1e-4

SOURCES = (compiled_algebra.__file__, compiled_contacts.__file__)
compiled = compiled_with(__file__, *SOURCES)
inlined = compiled_with(__file__, *SOURCES, inline=True)


@compiled
@no_type_check
def rotate(z, vector, at):
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


@inlined
@no_type_check
def local_velocity(z, size, v):
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
    square, once, twice = bend(c.patch_points[b].reshape(3, 1), 0, motion, place)
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


@inlined
@no_type_check
def free_motion(c, b, z, size, pushed, time, v, momentum, rate):
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


@inlined
@no_type_check
def set_masses(c, b, size, pushed, stiff, matrix):
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


@inlined
@no_type_check
def along(rows, j, row, v):
    """A row of the Jacobian, rows[j, row], times the velocities."""
    total = 0.0
    for k in range(len(v)):
        total += rows[j, row, k] * v[k]
    return total


@inlined
@no_type_check
def drag_of(friction, grip, force, r1, r2):
    """Friction by the speed of sliding under a normal force, N s/m."""
    limit = friction * force
    return limit / np.sqrt(r1 * r1 + r2 * r2 + (limit / grip) ** 2 + SLIP * SLIP)


@inlined
@no_type_check
def resist(c, b, step, v, chosen, floor, count, jacobian, gaps, springs, away, rows, matrix, right):
    """Add the chosen contacts, and the springs that hold it, to the lower half of a matrix and to the momentum, at
    about these velocities."""
    added = len(away)
    for j in range(added):
        i, axis = j // 3, j % 3
        active = step * c.hold_stiffness[b, i]
        rows.weights[j] = active * (step + c.hold_damping)
        for k in range(len(right)):
            rows.columns[k, j] = springs[i, axis, k]
            right[k] -= active * away[j] * springs[i, axis, k]
    for j in range(count):
        i, damping = chosen[j], c.floor_damping if j < floor else c.push_damping
        r0, time = along(jacobian, j, 0, v), step + damping
        force = c.stiffness[b, i] * (-gaps[j] - time * r0)
        if force <= 0.0 or (j < floor and gaps[j] + (step + c.onset) * r0 > 0.0):
            continue
        active, friction = step * c.stiffness[b, i], c.floor_friction if j < floor else c.push_friction
        drag = step * drag_of(friction, c.grip[b, i], force, along(jacobian, j, 1, v), along(jacobian, j, 2, v))
        added = press(jacobian, j, time * active, drag, -active * gaps[j], rows, added, right)
    add_squares(rows, added, matrix)


@inlined
@no_type_check
def press(jacobian, j, normal, drag, impulse, rows, added, right):
    """Add the three rows of a contact to those that resist, and what it adds to the momentum; how many rows there
    are then."""
    columns, weights = rows.columns, rows.weights
    weights[added], weights[added + 1], weights[added + 2] = normal, drag, drag
    for k in range(len(right)):
        columns[k, added], columns[k, added + 1] = jacobian[j, 0, k], jacobian[j, 1, k]
        columns[k, added + 2] = jacobian[j, 2, k]
        right[k] += impulse * jacobian[j, 0, k]
    return added + 3


@compiled
@no_type_check
def move(z, v, size, pushed, step, out):
    """The state after a step with constant velocities, in axes of the body."""
    copy(z, out)
    start, vector = 13 + size, np.empty(3)
    for axis in range(3):
        r0, r1, r2 = z[3 + 3 * axis], z[4 + 3 * axis], z[5 + 3 * axis]
        speed = r0 * v[0] + r1 * v[1] + r2 * v[2]
        spin = r0 * v[3] + r1 * v[4] + r2 * v[5]
        out[start + axis], out[start + 3 + axis] = speed, spin
        out[axis] += step * speed
        vector[axis] = step * spin
    rotate(out, vector, 0)
    for k in range(size):
        out[start + 6 + k] = v[6 + k]
        out[12 + k] += step * v[6 + k]
    if pushed:
        out[start + 6 + size] = v[6 + size]
        out[12 + size] += step * v[6 + size]
