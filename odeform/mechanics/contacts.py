"""Contacts of a batch of bodies, linearised: what moves at each, how deep it is, and how it resists."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.mechanics.body import ReducedBody
from odeform.mechanics.floor import Floor
from odeform.mechanics.law import MechanicalLaw
from odeform.mechanics.push import Push
from odeform.mechanics.state import State
from odeform.mechanics.turns import skew
from odeform.mechanics.warping import rotations, warped
from odeform.types import Floats, Ints

__all__ = ["Contacts", "floor_contacts", "joined", "push_contacts"]

MARGIN = 3e-3  # m; samples farther from contact than this and the way of two steps are left out
SLIP = 1e-4  # m/s below which friction grows with the speed of sliding however light the load
FLOOR, PUSH = 32, 64  # contacts with the floor and with the projectile that are followed: thin parts wrap around it
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Contacts:
    """C contacts in each of B motions."""

    jacobian: Float[np.ndarray, "batch contacts 3 velocities"]
    """Relative velocity at the contact, by the velocities of the state."""
    normal: Float[np.ndarray, "batch contacts 3"]
    """Direction in which the body is pushed."""
    gap: Float[np.ndarray, "batch contacts"]
    """m, negative in contact."""
    stiffness: Float[np.ndarray, "batch contacts"]
    """N/m."""
    damping: Float[np.ndarray, " contacts"]
    """s."""
    friction: Float[np.ndarray, " contacts"]
    """Coulomb coefficients."""
    grip: Float[np.ndarray, "batch contacts"]
    """N s/m: friction of contacts that slide too slowly for Coulomb's, by the speed of sliding."""

    @cached_property
    def along(self) -> Float[np.ndarray, "batch contacts velocities"]:
        """Relative velocity along the normal, by the velocities of the state."""
        return (self.normal[..., None, :] @ self.jacobian)[..., 0, :]

    def resistance(self, velocity: Floats, step: Float[np.ndarray, "batch 1"]) -> tuple[Floats, Floats]:
        """What C contacts add to the matrix (B, V, V) in kg and to the momentum (B, V) of a step that ends with about
        `velocity`: springs and dampers in the normal direction, friction against sliding, all implicit."""
        batch, size = velocity.shape
        rows = self.jacobian.reshape(batch, -1, size)
        relative = (rows @ velocity[..., None]).reshape(batch, -1, 3)
        away = (self.along @ velocity[..., None])[..., 0]
        time = step + self.damping
        force = self.stiffness * np.maximum(-self.gap - time * away, 0.0)
        active = np.where(force > 0.0, step * self.stiffness, 0.0)
        drag = step * self._drag(force, (relative * relative).sum(axis=-1) - away * away)
        columns = rows.transpose(0, 2, 1) * np.repeat(drag, 3, axis=1)[:, None]
        normals = self.along.transpose(0, 2, 1)
        matrix = columns @ rows + (normals * (time * active - drag)[:, None]) @ self.along
        return matrix, -(normals @ (active * self.gap)[..., None])[..., 0]

    def _drag(self, force: Floats, slide: Floats) -> Floats:
        """(B, C) N s/m: friction by the speed of sliding, with its square `slide` in m^2/s^2, under a normal force."""
        limit = self.friction * force
        return limit / np.sqrt(slide + (limit / self.grip) ** 2 + SLIP**2)

    def forces(self, velocity: Floats) -> Floats:
        """(B, C, 3) N on the body, at these velocities."""
        relative = (self.jacobian @ velocity[:, None, :, None])[..., 0]
        away = (self.normal * relative).sum(axis=-1)
        force = self.stiffness * np.maximum(-self.gap - self.damping * away, 0.0)
        slide = relative - away[..., None] * self.normal
        drag = self._drag(force, (slide * slide).sum(axis=-1))
        return force[..., None] * self.normal - drag[..., None] * slide


def joined(one: Contacts | None, other: Contacts | None) -> Contacts | None:
    """Contacts with the floor, and those with a projectile."""
    if one is None or other is None:
        return other if one is None else one
    return Contacts(
        np.concatenate([one.jacobian, other.jacobian], axis=1),
        np.concatenate([one.normal, other.normal], axis=1),
        np.concatenate([one.gap, other.gap], axis=1),
        np.concatenate([one.stiffness, other.stiffness], axis=1),
        np.concatenate([one.damping, other.damping]),
        np.concatenate([one.friction, other.friction]),
        np.concatenate([one.grip, other.grip], axis=1),
    )


def floor_contacts(
    body: ReducedBody, floor: Floor, law: MechanicalLaw, state: State, push: Push, step: float
) -> Contacts | None:
    """Contacts with the floor; None where no motion of the batch comes near it."""
    support, (batch, size) = body.support, push.squares.shape
    turns = (state.modes[:, None] @ push.support_turns).reshape(batch, -1, 3)
    deformed = support.points + warped((state.modes[:, None] @ push.support).reshape(batch, -1, 3), turns)
    gap = (deformed @ state.rotation[:, 2, :, None])[..., 0] + (state.shift[:, 2:] + body.solid.height + floor.offset)
    ahead = 2.0 * step + law.floor_damping
    chosen = _nearest(gap, MARGIN - ahead * min(float(state.velocity[:, 2].min()), 0.0), FLOOR)
    if chosen is None:
        return None
    row = np.arange(batch)[:, None]
    arms = deformed[row, chosen] @ state.rotation.transpose(0, 2, 1)
    count = chosen.shape[1]
    shapes = push.support.reshape(batch, size, -1, 3)[row, :, chosen].transpose(0, 1, 3, 2)
    return Contacts(
        _jacobian(arms, rotations(turns[row, chosen]) @ shapes, state),
        np.broadcast_to(UP, arms.shape),
        gap[row, chosen],
        floor.stiffness[chosen],
        np.full(count, law.floor_damping),
        np.full(count, law.floor_friction),
        law.floor_grip * body.support.masses[chosen],
    )


def push_contacts(push: Push, radius: float, law: MechanicalLaw, state: State, step: float) -> Contacts | None:
    """Contacts with projectiles of `radius` m; None where none touches."""
    batch = len(state.shift)
    turns = (push.turns @ state.modes[..., None]).reshape(push.points.shape)
    deformed = push.points + warped((push.shapes @ state.modes[..., None]).reshape(push.points.shape), turns)
    # in the axes of the body, in which samples need no rotation
    place = push.centres + state.projectile * push.guides
    centre = ((place - state.shift)[:, None] @ state.rotation)[:, 0]
    away = deformed - centre[:, None]
    gap = np.sqrt((away * away).sum(axis=2)) - radius
    speed = state.velocity[:, state.body :] * push.guides - state.velocity[:, :3]
    ahead = 2.0 * step + law.push_damping
    chosen = _nearest(gap, MARGIN + ahead * float(np.sqrt((speed * speed).sum(axis=1).max())), PUSH)
    if chosen is None:
        return None
    row = np.arange(batch)[:, None]
    shapes = push.shapes.reshape(*push.points.shape, -1)[row, chosen]
    gap, turn = gap[row, chosen], state.rotation.transpose(0, 2, 1)
    normal = (away[row, chosen] / np.maximum(gap + radius, 1e-9)[..., None]) @ turn
    jacobian = _jacobian(deformed[row, chosen] @ turn, rotations(turns[row, chosen]) @ shapes, state)
    jacobian[..., state.body] = -push.guides[:, None]
    count = chosen.shape[1]
    return Contacts(
        jacobian,
        normal,
        gap,
        law.push_stiffness * push.masses[row, chosen],
        np.full(count, law.push_damping),
        np.full(count, law.push_friction),
        law.push_grip * push.masses[row, chosen],
    )


def _nearest(gap: Floats, margin: float, most: int) -> Ints | None:
    """(B, C) the samples with the smallest gaps, as many as the motion with the most below `margin` has, or `most`."""
    count = min(int((gap < margin).sum(axis=1).max()), most)
    if count == 0:
        return None
    return np.argpartition(gap, count - 1, axis=1)[:, :count]


def _jacobian(arms: Floats, modes: Floats, state: State) -> Floats:
    """(B, C, 3, velocities) of points of the body at `arms` (B, C, 3) from its mass centre."""
    out = np.zeros((*arms.shape, state.velocity.shape[1]))
    out[..., [0, 1, 2], [0, 1, 2]] = 1.0
    out[..., 3:6] = -skew(arms)
    out[..., 6 : state.body] = state.rotation[:, None] @ modes
    return out
