"""A body as reduced mechanics knows it: inertia, modes, and the points of its surface that may touch something."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from odeform.types import Faces, Floats, Ints, Perpoint, Points

__all__ = ["SUPPORT", "ReducedBody", "Samples", "Solid", "reduce_body", "solid_of", "spread"]

SUPPORT = 96
"""Points spread over the surface that may touch the floor under a body that stands and is pushed."""
NEAR_FLOOR, NEAREST = 0.004, 40  # metres, and how many of the vertices below that may, too


@dataclass(frozen=True, eq=False)
class Samples:
    """S points of a surface, relative to the mass centre at rest."""

    points: Points
    """(S, 3) m."""
    rows: Float[np.ndarray, "6 samples modes"]
    """Modes there: each one's displacement (3) in m and rotation of the surface (3) in rad per root kilogram."""
    masses: Perpoint
    """(S,) kg of the body that each stands for, by its part of the surface."""

    @property
    def modes(self) -> Float[np.ndarray, "samples 3 modes"]:
        """The modes as displacements."""
        return self.rows[:3].transpose(1, 0, 2)

    @cached_property
    def tree(self) -> KDTree:
        """Finds the nearest samples of a point."""
        return KDTree(self.points)


@dataclass(frozen=True, eq=False)
class Solid:
    """Describes a body as a whole, at rest on the floor z = 0."""

    mass: float
    """kg"""
    height: float
    """m, of the mass centre above the floor."""
    inertia: Float[np.ndarray, "3 3"]
    """kg m^2 about the mass centre."""
    damping: float
    """Ratio of damping to stiffness, s."""


def solid_of(positions: Points, masses: Perpoint, damping: float) -> Solid:
    """Sums nodes (N, 3) m of `masses` (N,) kg that rest on the floor."""
    mass = float(masses.sum())
    centre = masses @ positions / mass
    arms = positions - centre
    squares = (arms**2).sum(axis=1)[:, None, None] * np.eye(3)
    inertia = np.einsum("n,nij->ij", masses, squares - arms[:, :, None] * arms[:, None])
    return Solid(mass, float(centre[2]), inertia, damping)


@dataclass(frozen=True, eq=False)
class ReducedBody:
    """A body as a whole, its modes, and where it may touch what is around it; in axes of the scene."""

    solid: Solid
    eigenvalues: Float[np.ndarray, " modes"]
    """(K,) squared angular frequencies, 1/s^2."""
    support: Samples
    """Samples that may be in contact with the floor."""
    surface: Samples
    """Samples at which something may push it: its V vertices, and then the middles of its faces."""
    fractions: Perpoint
    """(V,) of the mass, which each of its vertices stands for: inner nodes count for the nearest one."""

    def changed(self, mass: float, stiffness: float) -> "ReducedBody":
        """Returns the same body with so many times the mass and the stiffness. Its modes keep their shapes."""
        solid = self.solid
        parts = {
            name: replace(
                samples, rows=samples.rows / samples.rows.dtype.type(np.sqrt(mass)), masses=mass * samples.masses
            )
            for name, samples in (("support", self.support), ("surface", self.surface))
        }
        heavier = replace(solid, mass=mass * solid.mass, inertia=mass * solid.inertia)
        return replace(self, solid=heavier, eigenvalues=stiffness / mass * self.eigenvalues, **parts)

    @cached_property
    def reach(self) -> float:
        """Metres from the mass centre to the farthest sample of the support."""
        return float(np.sqrt((self.support.points**2).sum(axis=1).max()))

    def near(self, points: Float[np.ndarray, "batch 3"], count: int) -> Ints:
        """Computes (B, count) indices of the samples of the surface nearest to each point, m relative to the mass
        centre."""
        return self.surface.tree.query(points, min(count, len(self.surface.points)))[1].reshape(len(points), -1)


def spread(points: Points, count: int, first: int) -> Ints:
    """Chooses `count` of points (N, 3) m, or all, from the one at `first` on, each as far as possible from those before
    it; returns their indices (count,)."""
    chosen, distance = [first], np.full(len(points), np.inf)
    while len(chosen) < min(count, len(points)):
        distance = np.minimum(distance, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
        chosen.append(int(distance.argmax()))
    return np.array(chosen)


def reduce_body(
    surface: Points,
    faces: Faces,
    modes: Float[np.ndarray, "modes points 3"],
    modal_rotations: Float[np.ndarray, "points 3 modes"],
    eigenvalues: Floats,
    solid: Solid,
    fractions: Perpoint,
    support: int = SUPPORT,
) -> ReducedBody:
    """Makes the body from its surface (N, 3) m relative to the mass centre, the modes there in m per root kilogram, how
    they turn it (`surface_turns`), and the rest; `fractions` (N,) as of `ReducedBody`.

    `support` points spread over all of it, and some more below it, may touch the floor.
    """
    corners = surface[faces]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    around = np.bincount(faces.ravel(), np.repeat(areas / 6.0, 3), len(surface))
    # in this order in memory too, or else a gather of some samples copies all of them first
    rows = np.ascontiguousarray(np.concatenate([modes.transpose(2, 1, 0), modal_rotations.transpose(1, 0, 2)]))
    areas *= 0.5 * solid.mass / areas.sum()
    around *= 0.5 * solid.mass / around.sum()
    everywhere = Samples(
        np.concatenate([surface, corners.mean(axis=1)]),
        # half as much to gather for each push; the modes that a checkpoint holds have fewer digits yet
        np.concatenate([rows, rows[:, faces].mean(axis=2)], axis=1, dtype=np.float32),
        np.concatenate([around, areas]),
    )
    return ReducedBody(solid, eigenvalues, _support(surface, rows, solid.mass, support), everywhere, fractions)


def _support(points: Points, rows: Floats, mass: float, count: int) -> Samples:
    low = int(points[:, 2].argmin())
    bottom = np.flatnonzero(points[:, 2] < points[low, 2] + NEAR_FLOOR)
    kept = bottom[spread(points[bottom], NEAREST, int(np.flatnonzero(bottom == low)[0]))]
    chosen = np.unique(np.concatenate([spread(points, count, low), kept]))
    owner = KDTree(points[chosen]).query(points)[1]
    masses = mass * np.bincount(owner, minlength=len(chosen)) / len(points)
    return Samples(points[chosen], rows[:, chosen], masses)
