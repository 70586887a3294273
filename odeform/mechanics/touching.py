"""Where bodies of a batch touch the floor, and the projectiles that push them."""

import numpy as np
from jaxtyping import Float

from odeform.mechanics.contacts import Contacts
from odeform.mechanics.floor import Floor
from odeform.mechanics.law import MechanicalLaw
from odeform.mechanics.push import Push
from odeform.mechanics.state import State
from odeform.mechanics.turns import skew
from odeform.mechanics.warping import rotations, warped
from odeform.types import Floats, Ints, Rotations

__all__ = ["Touching"]

MARGIN = 3e-3  # m; samples farther from contact than this and the way of two steps are left out
FLOOR, PUSH = 32, 64  # contacts with the floor and with the projectile that are followed: thin parts wrap around it
UP_FIRST = [2, 0, 1]  # the scene's axes, as those of contacts with the floor


class Touching:
    """Finds the contacts of B pushed bodies, in their own axes, in which samples need no rotation."""

    def __init__(self, push: Push, floor: Floor, law: MechanicalLaw, radius: float) -> None:
        """Spheres of `radius` m push for as long as states hold them."""
        self._push, self._law, self._radius = push, law, radius
        self._level = floor.level
        batch, _, samples = push.points.shape
        self._springs = np.empty((4, batch, samples))
        stands, pushed = self._springs[..., : push.support], self._springs[..., push.support :]
        mass = push.masses[:, push.support :]
        stands[0], stands[1], stands[2] = floor.stiffness, law.floor_damping, law.floor_friction
        stands[3] = law.floor_grip * push.masses[:, : push.support]
        pushed[0], pushed[1], pushed[2] = law.push_stiffness * mass, law.push_damping, law.push_friction
        pushed[3] = law.push_grip * mass
        self._first = samples * np.arange(batch)[:, None]  # of each body, among all samples
        self._row = samples * np.arange(6)[:, None]

    def contacts(self, state: State, step: float) -> Contacts:
        """Those that may resist in a step of `step` seconds, and some more. There may be none."""
        push = self._push
        batch, _, samples = push.points.shape
        motion = (push.rows.reshape(batch, 6 * samples, -1) @ state.modes[..., None]).reshape(batch, 6, samples)
        motion[:, :3] = push.points + warped(motion[:, :3], motion[:, 3:])
        gap = np.empty((batch, samples))
        chosen = self._on_floor(state, step, motion, gap)
        stand = chosen.shape[1]
        if state.pushed:
            chosen = np.concatenate([chosen, self._at_sphere(state, step, motion, gap)], axis=1)
        there = motion.ravel().take((6 * self._first + chosen)[:, None] + self._row)
        gap = gap.ravel().take(self._first + chosen)
        axes = np.empty((*gap.shape, 3, 3))
        axes[:, :stand] = state.rotation[:, None, UP_FIRST]
        if state.pushed:
            away = there[:, :3, stand:] - self._centre(state)[..., None]
            axes[:, stand:] = _axes((away / np.maximum(gap[:, None, stand:] + self._radius, 1e-9)).swapaxes(1, 2))
        jacobian = self._jacobian(state, chosen, there, axes, stand)
        springs = self._springs.reshape(4, -1).take(self._first + chosen, axis=1)
        return Contacts(jacobian, gap, *springs)

    def _on_floor(self, state: State, step: float, motion: Floats, gap: Floats) -> Ints:
        """(B, C) samples near the floor; fills their gaps in."""
        support = self._push.support
        height = (state.rotation[:, 2:] @ motion[:, :3, :support])[:, 0] + (state.shift[:, 2:] + self._level)
        gap[:, :support] = height
        ahead = 2.0 * step + self._law.floor_damping
        return _nearest(height, MARGIN - ahead * min(float(state.velocity[:, 2].min()), 0.0), FLOOR)

    def _at_sphere(self, state: State, step: float, motion: Floats, gap: Floats) -> Ints:
        """(B, C) samples near the sphere; fills their gaps in."""
        push = self._push
        away = motion[:, :3, push.support :] - self._centre(state)[..., None]
        off = np.sqrt((away * away).sum(axis=1)) - self._radius
        gap[:, push.support :] = off
        speed = state.velocity[:, state.body :] * push.guides - state.velocity[:, :3]
        ahead = 2.0 * step + self._law.push_damping
        margin = MARGIN + ahead * float(np.sqrt((speed * speed).sum(axis=1).max()))
        return push.support + _nearest(off, margin, PUSH)

    def _centre(self, state: State) -> Float[np.ndarray, "batch 3"]:
        """m, of the spheres, in axes of the bodies."""
        place = self._push.centres + state.projectile * self._push.guides - state.shift
        return (place[:, None] @ state.rotation)[:, 0]

    def _jacobian(self, state: State, chosen: Ints, there: Floats, axes: Rotations, stand: int) -> Floats:
        """(B, C, 3, V): velocities of the chosen samples, which are at `there` (B, 6, C), in `axes` of the contacts."""
        push = self._push
        place, turns = there[:, :3].swapaxes(1, 2), there[:, 3:].swapaxes(1, 2)
        out = np.empty((*axes.shape[:3], state.velocity.shape[1]))
        out[..., :3] = axes
        np.matmul(axes, skew(-place), out=out[..., 3:6])
        rows = push.rows.reshape(-1, push.rows.shape[-1])
        shapes = rows.take((6 * self._first + chosen)[:, None] + self._row[:3], axis=0).swapaxes(1, 2)
        np.matmul(axes @ rotations(turns), shapes, out=out[..., 6 : state.body])
        if state.pushed:
            out[:, :stand, :, state.body] = 0.0
            guides = push.guides[:, None] @ state.rotation
            np.matmul(axes[:, stand:], -guides[..., None], out=out[:, stand:, :, state.body :])
        return out


def _nearest(gap: Floats, margin: float, most: int) -> Ints:
    """(B, C) the samples with the smallest gaps, as many as the motion with the most below `margin` has, or `most`."""
    count = min(int(np.count_nonzero(gap < margin, axis=1).max()), most)
    return np.argpartition(gap, max(count, 1) - 1, axis=1)[:, :count]


def _axes(normals: Float[np.ndarray, "*batch 3"]) -> Rotations:
    """(..., 3, 3) orthonormal rows of which the first is the normal: a reflection that carries it to an axis."""
    sign = np.copysign(1.0, normals[..., 0])
    half = normals.copy()
    half[..., 0] += sign
    scale = sign / np.abs(half[..., 0])
    return (scale[..., None] * half)[..., None] * half[..., None, :] - sign[..., None, None] * np.eye(3)
