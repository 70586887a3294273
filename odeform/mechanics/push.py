"""Bodies about to be pushed: the deformations that each push excites, and where the projectile may touch."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.mechanics.body import ReducedBody
from odeform.types import Floats, Ints, Vectors

__all__ = ["WIDTHS", "Push", "make_push"]

NEAR = 300  # samples around the contact that the projectile may touch
LOADED = 1000  # samples around the contact that patches of load may reach
WIDTHS = (0.006, 0.015)  # m, of the patches whose loads shape the local deformations


@dataclass(frozen=True, eq=False)
class Push:
    """B pushes of one body by rigid spheres, each on a guide along the constant force on it, without turning.

    The body deforms in K directions: its softest modes, which are the same for all pushes, and what loads around the
    contact do to the rest of its modes (attachment modes; Craig and Kurdila 2006, Fundamentals of Structural Dynamics,
    17.5). All are orthonormal under the body's mass, and diagonalise its stiffness.
    """

    modes: Float[np.ndarray, "batch modes directions"]
    """Amplitudes of the body's modes by those of the K directions."""
    squares: Float[np.ndarray, "batch directions"]
    """Squared angular frequencies, 1/s^2."""
    support: Float[np.ndarray, "batch directions flat"]
    """Displacement of the body's support, (S, 3) flat, by the directions."""
    support_turns: Float[np.ndarray, "batch directions flat"]
    """Its rotation."""
    centres: Float[np.ndarray, "batch 3"]
    """m, of the spheres at the start, relative to the mass centre of the body at rest."""
    guides: Float[np.ndarray, "batch 3"]
    """Of unit length."""
    forces: Float[np.ndarray, "batch 1"]
    """N along the guide."""
    points: Float[np.ndarray, "batch near 3"]
    """m: samples of the surface that the sphere may touch."""
    shapes: Float[np.ndarray, "batch entries directions"]
    """Their displacement by the directions, (N, 3) flat."""
    turns: Float[np.ndarray, "batch entries directions"]
    """Their rotation, as flat."""
    masses: Float[np.ndarray, "batch near"]
    """kg behind each."""

    @cached_property
    def twice(self) -> "Push":
        """For a batch of 2 B."""
        return Push(*(np.concatenate([getattr(self, f.name)] * 2) for f in fields(self)))


def make_push(body: ReducedBody, soft: int, contacts: Vectors, centres: Vectors, forces: Vectors) -> Push:
    """Spheres at `centres` that touch `contacts` (B, 3) m, relative to the mass centre, under `forces` (B, 3) N.

    The `soft` softest modes are among the directions of deformation. Without a force the guide points at the contact.
    """
    around = body.near(contacts, LOADED)
    modes, squares = _directions(body, soft, contacts, around)
    strength, inward = np.linalg.norm(forces, axis=1, keepdims=True), contacts - centres
    ahead = inward / np.linalg.norm(inward, axis=1, keepdims=True)
    guides = np.where(strength > 0.0, forces / np.where(strength > 0.0, strength, 1.0), ahead)
    near, surface = around[:, :NEAR], body.surface
    batch, count = near.shape
    shapes = surface.modes[near].reshape(batch, 3 * count, -1) @ modes
    support = modes.transpose(0, 2, 1) @ body.support.flat
    turns = surface.turns[near].reshape(batch, 3 * count, -1) @ modes
    support_turns = modes.transpose(0, 2, 1) @ body.support.flat_turns
    return Push(
        modes,
        squares,
        support,
        support_turns,
        centres,
        guides,
        strength,
        surface.points[near],
        shapes,
        turns,
        surface.masses[near],
    )


def _directions(body: ReducedBody, soft: int, contacts: Vectors, around: Ints) -> tuple[Floats, Floats]:
    """(B, M, K) and (B, K): see `Push`. `around` (B, N) are the samples of the surface nearest to the contacts."""
    away = ((body.surface.points[around] - contacts[:, None]) ** 2).sum(axis=2)
    patches = body.surface.masses[around] * np.exp(-away / np.square(WIDTHS)[:, None, None])
    patches = (patches / patches.sum(axis=2, keepdims=True)).swapaxes(0, 1)
    stiff, (batch, count) = body.squares[soft:], around.shape
    loads = patches @ body.surface.modes[around].reshape(batch, count, -1)
    loads = loads.reshape(batch, len(WIDTHS), 3, -1).transpose(0, 3, 2, 1)[:, soft:]
    local = np.linalg.qr(loads.reshape(*loads.shape[:2], -1) / stiff[:, None])[0]
    squares, turn = np.linalg.eigh(local.transpose(0, 2, 1) @ (stiff[:, None] * local))
    modes = np.zeros((batch, len(body.squares), soft + squares.shape[1]))
    modes[:, range(soft), range(soft)] = 1.0
    modes[:, soft:, soft:] = local @ turn
    return modes, np.concatenate([np.broadcast_to(body.squares[:soft], (batch, soft)), squares], axis=1)
