"""Contacts of a batch of bodies, linearised: what moves at each, how deep it is, and how it resists."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from odeform.types import Floats

__all__ = ["Contacts"]

SLIP = 1e-4  # m/s below which friction grows with the speed of sliding however light the load


@dataclass(frozen=True, eq=False)
class Contacts:
    """C contacts in each of B motions. Each has its own axes: along the normal, in which the body is pushed, and two
    across it."""

    jacobian: Float[np.ndarray, "batch contacts 3 velocities"]
    """Relative velocity in the axes of the contact, by the velocities of the body in its own axes."""
    gap: Float[np.ndarray, "batch contacts"]
    """m, negative in contact."""
    stiffness: Float[np.ndarray, "batch contacts"]
    """N/m."""
    damping: Float[np.ndarray, "batch contacts"]
    """s."""
    friction: Float[np.ndarray, "batch contacts"]
    """Coulomb coefficients."""
    grip: Float[np.ndarray, "batch contacts"]
    """N s/m: friction of contacts that slide too slowly for Coulomb's, by the speed of sliding."""
    onset: Float[np.ndarray, "batch contacts"]
    """s: a contact acts from where it would be one after that time."""

    @property
    def _rows(self) -> Float[np.ndarray, "batch rows velocities"]:
        batch, _, _, size = self.jacobian.shape
        return self.jacobian.reshape(batch, -1, size)

    def resistance(
        self, velocity: Float[np.ndarray, "#steps batch velocities"], step: Float[np.ndarray, "#steps #batch 1"]
    ) -> tuple[Floats, Floats]:
        """Returns what C contacts add to the matrix (H, B, V, V) in kg and to the momentum (H, B, V) of each of H steps
        that ends with about `velocity`: springs and dampers along the normal, friction against sliding, all
        implicit."""
        time = step + self.damping
        relative, force = self._at(velocity, time, step + self.onset)
        active = np.where(force > 0.0, step * self.stiffness, 0.0)
        # square roots, or else products that are symmetric by themselves take twice as long
        weights = np.empty((*force.shape, 3, 1))
        weights[..., 0, 0] = np.sqrt(time * active)
        weights[..., 1:, 0] = np.sqrt(step * self._drag(force, relative))[..., None]
        impulse = -(active * self.gap)[..., None, :] @ self.jacobian[:, :, 0]
        if len(self.gap) > 1:
            return self._squares(weights, ~(force <= 0.0)), impulse[..., 0, :]
        rows = (weights * self.jacobian).reshape(*force.shape[:2], -1, self.jacobian.shape[-1])
        return rows.swapaxes(-1, -2) @ rows, impulse[..., 0, :]

    def _squares(
        self, weights: Float[np.ndarray, "steps batch contacts 3 1"], pressed: Bool[np.ndarray, "steps batch contacts"]
    ) -> Float[np.ndarray, "steps batch velocities velocities"]:
        """Products of the weighted rows of each motion with themselves, without those of contacts that do not press:
        most of a batch's. These add nothing, but take as long."""
        steps, batch, size = *pressed.shape[:2], self.jacobian.shape[-1]
        out, some = np.empty((steps, batch, size, size)), np.asarray(pressed.any(axis=0))
        for index in range(batch):
            chosen = np.flatnonzero(some[index])
            rows = (weights[:, index, chosen] * self.jacobian[index, chosen]).reshape(steps, -1, size)
            np.matmul(rows.swapaxes(-1, -2), rows, out=out[:, index])
        return out

    def forces(self, velocity: Float[np.ndarray, "batch velocities"]) -> Float[np.ndarray, "batch velocities"]:
        """Returns what they add to the rate of the momentum, at these velocities."""
        relative, force = self._at(velocity[None], self.damping, self.onset)
        pushes = -self._drag(force, relative)[..., None] * relative
        pushes[..., 0] = force
        return (pushes.reshape(1, len(velocity), 1, -1) @ self._rows)[0, :, 0]

    def _at(self, velocity: Floats, time: Floats, begun: Floats) -> tuple[Floats, Floats]:
        """Relative velocities (H, B, C, 3) m/s, and normal forces (H, B, C) N once the bodies have moved for `time`, of
        those contacts that are reached in the time `begun`."""
        relative = (self._rows @ velocity[..., None]).reshape(*velocity.shape[:2], -1, 3)
        force = self.stiffness * np.maximum(-self.gap - time * relative[..., 0], 0.0)
        return relative, np.where(self.gap + begun * relative[..., 0] > 0.0, 0.0, force)

    def _drag(self, force: Floats, relative: Floats) -> Floats:
        """(H, B, C) N s/m: friction by the speed of sliding, under a normal force."""
        across, limit = relative[..., 1:], self.friction * force
        slide = across[..., 0] * across[..., 0] + across[..., 1] * across[..., 1]
        return limit / np.sqrt(slide + (limit / self.grip) ** 2 + SLIP**2)
