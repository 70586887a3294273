"""An elastic body that is held over a region: how it sags, its modes, and few directions in which it deforms far."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations_with_replacement

import numpy as np
from jaxtyping import Bool, Float
from scipy.sparse import csc_matrix, eye, kron
from scipy.sparse.linalg import SuperLU, eigsh, splu

from odeform.errors import InputError
from odeform.mechanics.quadratic import QuadraticMesh, Stiffness
from odeform.types import Floats, Ints, Points, Vector

__all__ = ["GRAVITY", "ClampedBody", "Weight", "held_by_ball", "held_by_face"]

GRAVITY = 9.80665  # m/s^2
TOLERANCE, MOST_STEPS, SMALLEST = (
    1e-6,
    60,
    2.0**-12,
)  # of a static solution: relative force, Newton steps, fraction of one
SHAPES = 8  # modes that the subspace begins with
CURVED = 5  # of its first directions, whose curvature is in it too
SAGS = (
    0.4,
    1.0,
    2.0,
)  # times the load, at which static solutions are in it: twice is how far a body that is let go swings
INDEPENDENT = 1e-4  # relative length of what a direction must add
REACH = 0.1  # of the body's size, that directions are scaled to


@dataclass(frozen=True, eq=False)
class Weight:
    """A mass without extent that is glued on, spread evenly over some places."""

    mass: float
    """kg"""
    places: Points
    """(P, 3) m, on the body without stress."""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass) and self.mass >= 0.0):
            raise InputError(f"weight: expected a mass of at least 0 kg, got {self.mass:g}")


def held_by_face(mesh: QuadraticMesh, axis: int, low: bool, tolerance: float = 1e-6) -> Bool[np.ndarray, " nodes"]:
    """(N,) the nodes on the face at the low or high end of an axis."""
    along = mesh.points[:, axis]
    end = along.min() if low else along.max()
    return np.abs(along - end) <= tolerance + 1e-6 * np.ptp(along)


def held_by_ball(mesh: QuadraticMesh, centre: Vector, radius: float) -> Bool[np.ndarray, " nodes"]:
    """(N,) the nodes within `radius` m of a point (3,) m."""
    return ((mesh.points - centre) ** 2).sum(axis=1) <= radius**2


@dataclass(frozen=True, eq=False)
class ClampedBody:
    """A body of a uniform material, of which some nodes never move."""

    stiffness: Stiffness
    density: float
    """kg/m^3."""
    held: Bool[np.ndarray, " nodes"]
    """(N,) the nodes that never move."""
    gravity: Vector
    """(3,) m/s^2."""
    weights: Sequence[Weight] = field(default=())

    def __post_init__(self) -> None:
        if not self.density > 0.0 or not np.isfinite(self.density):
            raise InputError(f"density: expected a positive number in kg/m^3, got {self.density:g}")
        if not self._spans():
            raise InputError(
                "clamp: expected a region that holds the body, got one with fewer than three of its points"
            )
        if self.held.all():
            raise InputError("clamp: expected a region that leaves a part of the body free, got all of it")

    def _spans(self) -> bool:
        """Whether the held nodes do not lie on one line, so that the body cannot turn."""
        points = self.mesh.points[self.held]
        if len(points) < 3:
            return False
        size = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        return bool(size[1] > 1e-6 * np.ptp(self.mesh.points, axis=0).max())

    @property
    def mesh(self) -> QuadraticMesh:
        """Its nodes and elements."""
        return self.stiffness.mesh

    def with_young(self, young: float) -> "ClampedBody":
        """Returns the same body of another Young's modulus in Pa."""
        return replace(self, stiffness=replace(self.stiffness, young=young))

    @cached_property
    def free(self) -> Ints:
        """Finds the indices (C,) of the coordinates that may move."""
        return np.flatnonzero(np.repeat(~self.held, 3))

    @cached_property
    def masses(self) -> csc_matrix:
        """(N, N) kg, the weights included."""
        found = self.mesh.masses(self.density)
        for weight in self.weights:
            rows = self.mesh.rows_at(weight.places)
            found = found + (weight.mass / len(weight.places)) * (rows.T @ rows)
        return found.tocsc()

    @cached_property
    def load(self) -> Points:
        """(N, 3) N: gravity on the body and on the weights."""
        rows = np.asarray(self.masses.sum(axis=1)).ravel()
        return rows[:, None] * self.gravity

    def static(self, factor: float = 1.0, start: Points | None = None) -> Points:
        """(N, 3) m by which the nodes are displaced where the body hangs under `factor` times the load.

        Rotations and strains may be large. `InputError` where no equilibrium is found, as where a body collapses.
        """
        moved = np.zeros(self.mesh.points.shape) if start is None else start.copy()
        target, free = factor * self.load, self.free
        size = max(float(np.linalg.norm(target.ravel()[free])), 1e-12)
        rest = self._missing(moved, target)
        for _ in range(MOST_STEPS):
            if np.linalg.norm(rest) <= TOLERANCE * size:
                return moved
            step = self._solver(moved).solve(rest)
            moved, rest = self._shortened(moved, step, rest, target)
        raise InputError("the clamped body finds no equilibrium under its load: it is too soft for it")

    def _shortened(self, moved: Points, step: Floats, rest: Floats, target: Points) -> tuple[Points, Floats]:
        """The longest of the whole step, half of it, and so on, that does not raise the energy along it."""
        fraction = 1.0
        while True:
            found = self._filled(fraction * step) + moved
            left = self._missing(found, target)
            # at the end of an overlong step the remaining force pulls back harder than it pulled forward
            if step @ left > -0.5 * abs(step @ rest) or fraction <= SMALLEST:
                return found, left
            fraction *= 0.5

    def _missing(self, moved: Points, target: Points) -> Floats:
        return (target + self.stiffness.forces(moved)).ravel()[self.free]

    def _solver(self, moved: Points) -> SuperLU:
        return splu(self.stiffness.tangent(moved)[self.free][:, self.free].tocsc())

    def _filled(self, values: Floats) -> Points:
        found = np.zeros(self.mesh.points.size)
        found[self.free] = values
        return found.reshape(-1, 3)

    @cached_property
    def _mass(self) -> csc_matrix:
        return csc_matrix(kron(self.masses, eye(3)))

    def modes(self, count: int) -> tuple[Floats, Float[np.ndarray, "modes nodes 3"]]:
        """(K,) squared angular frequencies of the `count` softest modes around the shape without stress, and (K, N, 3)
        the modes in m per root kilogram."""
        still = np.zeros(self.mesh.points.shape)
        stiffness = self.stiffness.tangent(still)[self.free][:, self.free]
        start = np.random.default_rng(0).standard_normal(len(self.free))  # or results differ from run to run
        mass = self._mass[self.free][:, self.free]
        squares, vectors = eigsh(stiffness, min(count, len(self.free) - 1), mass, sigma=0.0, v0=start)
        order = np.argsort(squares)
        return squares[order], np.stack([self._filled(vectors[:, index]) for index in order])

    def directions(self, shapes: int = SHAPES, curved: int = CURVED) -> Float[np.ndarray, "directions nodes 3"]:
        """(R, N, 3): directions, orthonormal under the masses, in which it deforms far: how it answers its load, its
        softest modes, how these curve when they grow (modal derivatives; Idelsohn and Cardona 1985, Computer Methods in
        Applied Mechanics and Engineering 49), and where it hangs under some multiples of its load."""
        still = np.zeros(self.mesh.points.shape)
        solver = self._solver(still)
        first = [self._filled(solver.solve(self.load.ravel()[self.free])), *self.modes(shapes)[1]]
        size = REACH * float(np.ptp(self.mesh.points, axis=0).max())
        first = [one * (size / max(float(np.abs(one).max()), 1e-300)) for one in first]
        bent = [
            self._filled(solver.solve(self._second(one, other).ravel()[self.free]))
            for one, other in combinations_with_replacement(first[:curved], 2)
        ]
        hanging: list[Points] = []
        for factor in SAGS:
            hanging.append(self.static(factor, hanging[-1] if hanging else None))
        return self._independent([*first, *hanging, *bent])

    def _second(self, one: Points, other: Points) -> Points:
        """(N, 3) N: the part of the forces that is of second order, bilinear in two displacements."""

        def even(moved: Points) -> Points:
            return 0.5 * (self.stiffness.forces(moved) + self.stiffness.forces(-moved))

        return 0.25 * (even(one + other) - even(one - other))

    def _independent(self, shapes: Sequence[Points]) -> Floats:
        """Gram-Schmidt under the masses, twice; what adds next to nothing is left out."""
        kept: list[Floats] = []
        for shape in shapes:
            vector = shape.ravel().copy()
            length = np.sqrt(vector @ (self._mass @ vector))
            for _ in range(2):
                for other in kept:
                    vector -= (other @ (self._mass @ vector)) * other
            rest = np.sqrt(vector @ (self._mass @ vector))
            if rest > INDEPENDENT * length > 0.0:
                kept.append(vector / rest)
        return np.stack(kept).reshape(len(kept), -1, 3)
