"""Bodies about to be pushed: the deformations that each push excites, and where they may touch floor and projectile."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.loads.situation import Clamp, Pulse
from odeform.mechanics.body import ReducedBody
from odeform.mechanics.holding import Hold, grip_of
from odeform.mechanics.obstacles import Obstacles
from odeform.types import Floats, Ints, Vector, Vectors

__all__ = ["WIDTHS", "Patch", "Push", "held", "kicked", "make_push", "no_push"]

NEAR = 300  # samples around the contact that the projectile may touch
WIDTHS = (0.006, 0.015)  # m, of the patches whose loads shape the local deformations
LOADED, REACH = 1000, 3.0  # samples that patches may load at most, up to so many times the largest width away
LEAST = 1e-6  # of the largest weight of a vertex in the patch of a pulse, below which it is left out
LONGEST = 0.25  # of a pulse, a step while it acts
PARTS = ("modes", "eigenvalues", "points", "rows", "masses", "centres", "guides", "forces")  # of each push


@dataclass(frozen=True, eq=False)
class Patch:
    """A force on a patch of each of B bodies, which rises and falls as sin^2 of the time, from time 0 on.

    It acts on what the patch does in the mean, and keeps its direction when the body turns.
    """

    points: Float[np.ndarray, "batch 3"]
    """m, from the mass centre."""
    rows: Float[np.ndarray, "batch 6 directions"]
    """Displacement (3) and rotation (3) by the directions of deformation, as in `Push`."""
    forces: Float[np.ndarray, "batch 3"]
    """N at the peak, in axes of the scene."""
    duration: float
    """s"""

    def followed(self, times: Floats, steps: Floats, errors: Floats) -> Floats:
        """Errors (R,) of steps (R,) s from times (R,) s, without bound for those that are too long for the pulse: a
        step that ends after it has not seen it."""
        return np.where((times < self.duration) & (steps > LONGEST * self.duration), np.inf, errors)

    def some(self, rows: Ints) -> "Patch":
        """Those of the bodies `rows` (R,)."""
        return replace(self, points=self.points[rows], rows=self.rows[rows], forces=self.forces[rows])


@dataclass(frozen=True, eq=False)
class Push:
    """B pushes of one body by rigid spheres, each on a guide along the constant force on it, without turning.

    The body deforms in K directions: its softest modes, which are the same for all pushes, and what loads around the
    contact do to the rest of its modes (attachment modes; Craig and Kurdila 2006, Fundamentals of Structural Dynamics,
    17.5). All are orthonormal under the body's mass, and diagonalise its stiffness.
    """

    modes: Float[np.ndarray, "batch modes directions"]
    """Amplitudes of the body's modes by those of the K directions."""
    eigenvalues: Float[np.ndarray, "batch directions"]
    """Squared angular frequencies, 1/s^2."""
    support: int
    """The first samples are those that may touch the floor; the sphere may touch the others."""
    points: Float[np.ndarray, "batch 3 samples"]
    """m: samples of the surface."""
    rows: Float[np.ndarray, "batch 6 samples directions"]
    """Their displacement (3) and rotation (3) by the directions."""
    masses: Float[np.ndarray, "batch samples"]
    """kg behind each."""
    centres: Float[np.ndarray, "batch 3"]
    """m, of the spheres at the start, relative to the mass centre of the body at rest."""
    guides: Float[np.ndarray, "batch 3"]
    """Directions of unit length."""
    forces: Float[np.ndarray, "batch 1"]
    """N along the guide."""
    patch: Patch | None = None
    """A force besides that of the sphere."""
    obstacles: Obstacles | None = None
    """What the support may touch besides the floor."""
    hold: Hold | None = None
    """Springs that hold a patch of it."""

    def some(self, rows: Ints) -> "Push":
        """The pushes `rows` (R,)."""
        each = {name: getattr(self, name)[rows] for name in PARTS}
        patch = None if self.patch is None else self.patch.some(rows)
        others = {"obstacles": self.obstacles, "hold": self.hold}
        return replace(self, **each, patch=patch, **{k: v and v.some(rows) for k, v in others.items()})

    @cached_property
    def over(self) -> "Push":
        """Returns the same without the samples that the sphere may touch."""
        parts = (self.points[..., : self.support], self.rows[:, :, : self.support], self.masses[:, : self.support])
        points, rows, masses = (np.ascontiguousarray(part) for part in parts)
        return replace(self, points=points, rows=rows, masses=masses)


def make_push(body: ReducedBody, soft: int, contacts: Vectors, centres: Vectors, forces: Vectors) -> Push:
    """Spheres at `centres` that touch `contacts` (B, 3) m, relative to the mass centre, under `forces` (B, 3) N.

    The `soft` softest modes are among the directions of deformation. Without a force the guide points at the contact.
    """
    around = body.near(contacts, LOADED)
    modes, eigenvalues = _directions(body, soft, contacts, around)
    strength, inward = np.linalg.norm(forces, axis=1, keepdims=True), contacts - centres
    ahead = inward / np.linalg.norm(inward, axis=1, keepdims=True)
    guides = np.where(strength > 0.0, forces / np.where(strength > 0.0, strength, 1.0), ahead)
    near, support, surface = around[:, :NEAR], body.support, body.surface
    batch, count = len(near), len(support.points)
    samples = count + near.shape[1]
    points, masses = np.empty((batch, 3, samples)), np.empty((batch, samples))
    rows = np.empty((batch, 6, samples, modes.shape[2]))
    points[..., :count], points[..., count:] = support.points.T, surface.points[near].swapaxes(1, 2)
    masses[:, :count], masses[:, count:] = support.masses, surface.masses[near]
    single = modes.astype(surface.rows.dtype)
    for index in range(batch):
        for row, stand, touched in zip(rows[index], support.rows, surface.rows, strict=True):
            # one component after the other: what is gathered stays in the cache
            _fill(row[:count], stand, modes[index], soft)
            _fill(row[count:], touched.take(near[index], axis=0), single[index], soft)
    return Push(modes, eigenvalues, count, points, rows, masses, centres, guides, strength)


def no_push(body: ReducedBody, soft: int) -> Push:
    """A body that nothing but the floor touches, in its `soft` softest modes."""
    soft = min(soft, len(body.eigenvalues))
    return _without_sphere(body, np.eye(len(body.eigenvalues))[None, :, :soft], body.eigenvalues[None, :soft], soft)


def kicked(body: ReducedBody, soft: int, middle: Vector, pulse: Pulse) -> Push:
    """A body that a pulse acts on around a point (3,) m, relative to its mass centre. The `soft` softest modes are
    among the directions of deformation."""
    modes, eigenvalues = _directions(body, soft, middle[None], body.near(middle[None], LOADED))
    surface, vertices = body.surface, body.surface.points[: len(body.fractions)]
    weights = pulse.weights(vertices, body.fractions, middle)
    patched = np.flatnonzero(weights > LEAST * weights.max())
    weights = weights[patched] / weights[patched].sum()
    rows = np.stack([weights @ row.take(patched, axis=0) for row in surface.rows]) @ modes[0]
    patch = Patch((weights @ vertices[patched])[None], rows[None], pulse.force[None], pulse.duration)
    return replace(_without_sphere(body, modes, eigenvalues, soft), patch=patch)


def held(body: ReducedBody, soft: int, clamp: Clamp) -> Push:
    """A body that a clamp holds. The `soft` softest modes are among the directions of deformation; the others are what
    forces of the clamp do to the rest of its modes."""
    grip, soft = grip_of(body, clamp), min(soft, len(body.eigenvalues))
    modes, eigenvalues = _attached(body.eigenvalues, soft, grip.loads[None, soft:])
    hold = Hold.of(body, grip, modes[0], clamp.damping)
    return replace(_without_sphere(body, modes, eigenvalues, soft), hold=hold)


def _without_sphere(body: ReducedBody, modes: Floats, eigenvalues: Floats, soft: int) -> Push:
    """One body that moves in directions (1, M, K)."""
    support = body.support
    rows = np.empty((1, 6, len(support.points), modes.shape[2]))
    for row, known in zip(rows[0], support.rows, strict=True):
        _fill(row, known, modes[0], soft)
    points, masses = np.ascontiguousarray(support.points.T)[None], support.masses[None]
    none = np.zeros((1, 3)), np.eye(3)[:1], np.zeros((1, 1))
    return Push(modes, eigenvalues, len(support.points), points, rows, masses, *none)


def _fill(out: Floats, values: Floats, modes: Floats, soft: int) -> None:
    """`out` (N, K): what directions do, from what modes do (N, M). The first `soft` are modes themselves."""
    out[:, :soft] = values[:, :soft]
    out[:, soft:] = values[:, soft:] @ modes[soft:, soft:]


def _directions(body: ReducedBody, soft: int, contacts: Vectors, around: Ints) -> tuple[Floats, Floats]:
    """(B, M, K) and (B, K): see `Push`. `around` (B, N) are the samples of the surface nearest to the contacts."""
    away = ((body.surface.points[around] - contacts[:, None]) ** 2).sum(axis=2)
    patches = body.surface.masses[around] * np.exp(-away / np.square(WIDTHS)[:, None, None])
    patches = (patches / patches.sum(axis=2, keepdims=True)).swapaxes(0, 1).astype(body.surface.rows.dtype)
    stiff, batch = body.eigenvalues[soft:], len(around)
    loads = np.empty((batch, len(stiff), 3, len(WIDTHS)))
    # from near to far; the nearest one is loaded wherever it is
    counts = np.maximum((away <= (REACH * max(WIDTHS)) ** 2).sum(axis=1), 1)
    for load, patch, loaded, count in zip(loads, patches, around, counts, strict=True):
        for axis in range(3):
            load[:, axis] = (patch[:, :count] @ body.surface.rows[axis].take(loaded[:count], axis=0))[:, soft:].T
    return _attached(body.eigenvalues, soft, loads.reshape(batch, len(stiff), -1))


def _attached(squares: Floats, soft: int, loads: Float[np.ndarray, "batch stiff loads"]) -> tuple[Floats, Floats]:
    """(B, M, K) and (B, K): the `soft` softest of modes with squared frequencies (M,), and what `loads` on the other
    modes do to these."""
    stiff, batch = squares[soft:], len(loads)
    local = np.linalg.qr(loads / stiff[:, None])[0]
    eigenvalues, turn = np.linalg.eigh(local.transpose(0, 2, 1) @ (stiff[:, None] * local))
    modes = np.zeros((batch, len(squares), soft + eigenvalues.shape[1]))
    modes[:, range(soft), range(soft)] = 1.0
    modes[:, soft:, soft:] = local @ turn
    return modes, np.concatenate([np.broadcast_to(squares[:soft], (batch, soft)), eigenvalues], axis=1)
