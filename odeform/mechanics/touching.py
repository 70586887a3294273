"""Finds where bodies of a batch are in contact: with the floor, with obstacles, and with the projectiles that push
them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.contacts import Contacts
from odeform.mechanics.floor import Floor
from odeform.mechanics.obstacles import Obstacles
from odeform.mechanics.push import Push
from odeform.mechanics.rotations import skew
from odeform.mechanics.state import State
from odeform.mechanics.warping import bent
from odeform.types import Floats, Ints, Rotations

__all__ = ["MARGIN", "Near", "Touching", "axes_of", "most_contacts"]

MARGIN = 1e-3  # m; samples farther from contact than this and the way of two steps are left out
PUSH = 64  # contacts with the projectile that are followed: thin parts wrap around it
UP_FIRST = [2, 0, 1]  # the scene's axes, as those of contacts with the floor


def most_contacts(support: int) -> int:
    """How many contacts with the floor are followed, of the samples that may touch it."""
    return max(64, support // 3)


@dataclass(frozen=True, eq=False)
class Near:
    """C samples of each of B bodies that may touch something in a step: the first F the floor, the next ones an
    obstacle each, the others a sphere."""

    push: Push
    radius: float
    """m, of the spheres."""
    points: Float[np.ndarray, "batch 3 contacts"]
    """m at rest, from the mass centre."""
    rows: Float[np.ndarray, "batch 6 contacts directions"]
    """Displacements there by the directions of deformation, as in `Push`."""
    level: Float[np.ndarray, "batch floor"]
    """m, as in `Floor`."""
    springs: Float[np.ndarray, "5 batch contacts"]
    """Parameters of springs, as in `Contacts`."""
    obstacles: tuple[tuple[Obstacles, int], ...] = ()
    """One for each body, and how many samples may touch it."""

    def contacts(self, state: State) -> Contacts:
        """Linearised about a state, in axes of the bodies, in which samples need no rotation."""
        turning, place = bent(self.points, self.rows, state)
        floor = self.level.shape[1]
        fixed = floor + sum(count for _, count in self.obstacles)
        axes = np.empty((len(place), place.shape[2], 3, 3))
        gap = np.empty((len(place), place.shape[2]))
        gap[:, :floor] = _heights(place[..., :floor], self.level, state)
        axes[:, :floor] = state.rotation[:, None, UP_FIRST]
        first = floor
        for obstacle, count in self.obstacles:
            some = slice(first, first + count)
            gap[:, some], normals = obstacle.met(_in_scene(place[..., some], state))
            axes[:, some] = axes_of(normals @ state.rotation)
            first += count
        if state.pushed:
            away = place[..., fixed:] - _centre(self.push, state)
            distance = np.sqrt((away * away).sum(axis=1))
            gap[:, fixed:] = distance - self.radius
            axes[:, fixed:] = axes_of((away / np.maximum(distance, 1e-9)[:, None]).swapaxes(1, 2))
        out = np.empty((*axes.shape[:3], state.velocity.shape[1]))
        out[..., :3] = axes
        np.matmul(axes, skew(-place.swapaxes(1, 2)), out=out[..., 3:6])
        np.matmul(axes @ turning.rotations, self.rows[:, :3].swapaxes(1, 2), out=out[..., 6 : state.body])
        if state.pushed:
            out[:, :fixed, :, -1] = 0.0
            guides = self.push.guides[:, None] @ state.rotation
            np.matmul(axes[:, fixed:], -guides[..., None], out=out[:, fixed:, :, state.body :])
        return Contacts(out, gap, *self.springs)


class Touching:
    """Finds where B pushed bodies may touch something."""

    def __init__(
        self, push: Push, floor: Floor, parameters: ContactParameters, radius: float, reach: float, lands: bool
    ) -> None:
        """Spheres of `radius` m push for as long as states hold them; no sample of the support is farther than `reach`
        m from the mass centre. The floor's dampers act before contact, unless a body `lands`."""
        self._push, self._parameters = push, parameters
        self._most = most_contacts(push.support)
        self._radius, self._level, self._reach = radius, floor.level, reach
        batch, _, samples = push.points.shape
        self._springs = np.empty((5, batch, samples))
        stands, pushed = self._springs[..., : push.support], self._springs[..., push.support :]
        mass = push.masses[:, push.support :]
        stands[0], stands[1], stands[2] = floor.stiffness, parameters.floor_damping, parameters.floor_friction
        stands[3] = parameters.floor_regularisation * push.masses[:, : push.support]
        pushed[0] = parameters.push_stiffness * mass
        pushed[1], pushed[2] = parameters.push_damping, parameters.push_friction
        pushed[3] = parameters.push_regularisation * mass
        stands[4], pushed[4] = 0.0 if lands else parameters.floor_damping, parameters.push_damping
        self._first = samples * np.arange(batch)[:, None]  # of each body, among all samples
        self._row = samples * np.arange(6)[:, None]

    def near(self, state: State, step: float | Floats) -> Near:
        """The samples that may touch something in a step of `step` seconds, one or (B,). There may be none. Where
        another motion has more, others go along, which have no stiffness."""
        push = self._push
        _, place = bent(push.points, push.rows, state)
        height = _heights(place[..., : push.support], self._level, state)
        spin = np.sqrt((state.velocity[:, 3:6] ** 2).sum(axis=1))
        down = np.minimum(state.velocity[:, 2] - self._reach * spin, 0.0)
        margin = MARGIN - (2.0 * step + self._parameters.floor_damping) * down
        stand, real = _nearest(height, margin[:, None], self._most)
        chosen, obstacles = stand, ()
        if push.obstacles is not None:
            met, close, obstacles = self._met(push.obstacles, place[..., : push.support], state, spin, step)
            chosen, real = np.concatenate([stand, met], axis=1), np.concatenate([real, close], axis=1)
        if state.pushed:
            away = place[..., push.support :] - _centre(push, state)
            distance = np.sqrt((away * away).sum(axis=1))
            speed = state.velocity[:, state.body :] * push.guides - state.velocity[:, :3]
            way = (2.0 * step + self._parameters.push_damping) * np.sqrt((speed * speed).sum(axis=1))
            pushed, touched = _nearest(distance, (self._radius + MARGIN + way)[:, None], PUSH)
            chosen = np.concatenate([chosen, push.support + pushed], axis=1)
            real = np.concatenate([real, touched], axis=1)
        springs = self._springs.reshape(5, -1).take(self._first + chosen, axis=1)
        springs[0] *= real
        return Near(
            push,
            self._radius,
            push.points.ravel().take((3 * self._first + chosen)[:, None] + self._row[:3]),
            push.rows.reshape(-1, push.rows.shape[-1]).take((6 * self._first + chosen)[:, None] + self._row, axis=0),
            self._level.take(stand),
            springs,
            obstacles,
        )

    def _met(
        self, obstacles: Obstacles, place: Floats, state: State, spin: Floats, step: float | Floats
    ) -> tuple[Ints, Bool[np.ndarray, "batch contacts"], tuple[tuple[Obstacles, int], ...]]:
        """The samples of the support that may touch an obstacle, one obstacle after the other, which of them do, and
        how many of each."""
        ahead = np.reshape(2.0 * np.asarray(step) + self._parameters.floor_damping, (-1, 1))
        points, velocity = _in_scene(place, state), state.velocity[:, :3, None]
        chosen, real, counts = [], [], []
        for obstacle in obstacles.each:
            gap, normals = obstacle.met(points)
            # convex obstacles: no sample gets nearer than along the normal where it is
            towards = np.minimum((normals @ velocity)[..., 0] - self._reach * spin[:, None], 0.0)
            some, close = _nearest(gap, MARGIN - ahead * towards, self._most)
            chosen.append(some)
            real.append(close)
            counts.append((obstacle, some.shape[1]))
        return np.concatenate(chosen, axis=1), np.concatenate(real, axis=1), tuple(counts)


def _heights(place: Floats, level: Floats, state: State) -> Float[np.ndarray, "batch samples"]:
    """m above the floor."""
    return (state.rotation[:, 2:] @ place)[:, 0] + (state.shift[:, 2:] + level)


def _in_scene(place: Floats, state: State) -> Float[np.ndarray, "batch samples 3"]:
    """m in axes of the scene, from where the mass centres rest, of samples (B, 3, S) from these."""
    return (state.rotation @ place).swapaxes(1, 2) + state.shift[:, None]


def _centre(push: Push, state: State) -> Float[np.ndarray, "batch 3 1"]:
    """m, of the spheres, from the mass centres."""
    place = push.centres + state.projectile * push.guides - state.shift
    return state.rotation.swapaxes(1, 2) @ place[..., None]


def _nearest(
    gap: Float[np.ndarray, "batch samples"], margin: Floats, most: int
) -> tuple[Ints, Bool[np.ndarray, "batch contacts"]]:
    """(B, C) the samples with the smallest gaps, as many as the motion with the most below its `margin` has, or `most`;
    and which of them are below it; it is (B, 1), or (B, S) for each sample."""
    below = gap < margin
    count = min(int(np.count_nonzero(below, axis=1).max()), most)
    chosen = np.argpartition(gap, max(count, 1) - 1, axis=1)[:, :count]
    return chosen, np.take_along_axis(below, chosen, axis=1)


def axes_of(normals: Float[np.ndarray, "*batch 3"]) -> Rotations:
    """(..., 3, 3) orthonormal rows of which the first is the normal: a reflection that carries it to an axis."""
    sign = np.copysign(1.0, normals[..., 0])
    half = normals.copy()
    half[..., 0] += sign
    scale = sign / np.abs(half[..., 0])
    out = (scale[..., None] * half)[..., None] * half[..., None, :]
    out.reshape(*sign.shape, 9)[..., ::4] -= sign[..., None]
    return out
