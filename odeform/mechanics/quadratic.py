"""Quadratic tetrahedra of Saint Venant-Kirchhoff material, for bending and for what is nearly incompressible.

Displacements are quadratic and the change of volume is averaged over each element, so that a Poisson's ratio of
0.499 does not lock them (the pair P2-P0; Boffi, Brezzi and Fortin 2013, Mixed Finite Element Methods, 8.4). Sides are
straight.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.sparse import csc_matrix

from odeform.errors import InputError
from odeform.types import Floats, Ints, Perpoint, Points

__all__ = ["EDGES", "QuadraticMesh", "Stiffness", "quadratic_mesh"]

EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
"""Corners at the ends of the six edges, whose middles are the nodes 4 to 9 of an element."""
NEAR, FAR = 0.13819660112501053, 0.5854101966249685  # barycentric coordinates of the four points of integration


@dataclass(frozen=True, eq=False)
class QuadraticMesh:
    """N nodes, the corners of tetrahedra first, and elements of ten."""

    points: Points
    """(N, 3) m without stress."""
    elements: Ints
    """(M, 10): four corners, then the middles of `EDGES`."""
    corners: int
    """Number of nodes that are corners."""

    @cached_property
    def volumes(self) -> Float[np.ndarray, " elements"]:
        """(M,) m^3."""
        return np.abs(np.linalg.det(self._sides)) / 6.0

    @property
    def _sides(self) -> Floats:
        corners = self.points[self.elements[:, :4]]
        return (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)

    @cached_property
    def barycentric(self) -> Float[np.ndarray, "elements 4 3"]:
        """Slopes of the four barycentric coordinates of each element, 1/m."""
        inverse = np.linalg.inv(self._sides)
        return np.concatenate([-inverse.sum(axis=1)[:, None], inverse], axis=1)

    @cached_property
    def slopes(self) -> Float[np.ndarray, "elements 4 10 3"]:
        """Slopes of the shape functions at the points of integration, 1/m."""
        places = np.full((4, 4), NEAR) + (FAR - NEAR) * np.eye(4)
        return np.stack([_slopes(self.barycentric, place) for place in places], axis=1)

    def masses(self, density: float) -> csc_matrix:
        """(N, N) kg: the consistent masses of a body of `density` kg/m^3."""
        return self.assembled((density * self.volumes)[:, None, None] * _unit_masses(), 1)

    def assembled(self, blocks: Floats, size: int) -> csc_matrix:
        """The (size N, size N) matrix of blocks (M, 10 size, 10 size) of the elements."""
        entries = (size * self.elements[:, :, None] + np.arange(size)).reshape(len(self.elements), -1)
        rows = np.repeat(entries, entries.shape[1], axis=1).ravel()
        columns = np.tile(entries, (1, entries.shape[1])).ravel()
        count = size * len(self.points)
        return csc_matrix((blocks.ravel(), (rows, columns)), shape=(count, count))

    def rows_at(self, places: Points) -> csc_matrix:
        """(P, N) weights of the nodes' displacements at places (P, 3) m. A place outside, such as a marker that is
        glued on, moves with the nearest point of the body and turns as the body does there."""
        rows = np.zeros((len(places), len(self.points)))
        origins = self.points[self.elements[:, 0]]
        for row, place in zip(rows, np.asarray(places, dtype=float), strict=True):
            inner = np.einsum("mid,md->mi", self.barycentric, place - origins)
            inner[:, 0] += 1.0
            inner = np.maximum(inner, 0.0)
            inner /= inner.sum(axis=1, keepdims=True)
            inside = np.einsum("mi,mid->md", inner, self.points[self.elements[:, :4]])
            best = int(((inside - place) ** 2).sum(axis=1).argmin())
            values = _values(inner[best]) + _slopes(self.barycentric[best : best + 1], inner[best])[0] @ (
                place - inside[best]
            )
            np.add.at(row, self.elements[best], values)
        return csc_matrix(rows)


def quadratic_mesh(points: Points, elements: Ints) -> QuadraticMesh:
    """Add a node in the middle of each edge of tetrahedra (M, 4) with corners (N, 3) m. `InputError` for others."""
    if elements.ndim != 2 or elements.shape[1] != 4:
        raise InputError(f"expected tetrahedra (M, 4), got {elements.shape}")
    used, elements = np.unique(elements, return_inverse=True)
    elements = elements.reshape(-1, 4)
    points = np.asarray(points, dtype=float)[used]
    edges = np.sort(elements[:, EDGES], axis=2).reshape(-1, 2)
    unique, place = np.unique(edges, axis=0, return_inverse=True)
    middles = points[unique].mean(axis=1)
    nodes = len(points) + place.reshape(-1, 6)
    return QuadraticMesh(np.concatenate([points, middles]), np.concatenate([elements, nodes], axis=1), len(points))


@dataclass(frozen=True, eq=False)
class Stiffness:
    """Forces of the material in a mesh, and their derivative."""

    mesh: QuadraticMesh
    young: float
    """Pa."""
    poisson: float

    def __post_init__(self) -> None:
        if not (self.young > 0.0 and np.isfinite(self.young)):
            raise InputError(f"Young's modulus: expected a positive number in Pa, got {self.young:g}")
        if not -1.0 < self.poisson < 0.5:
            raise InputError(f"Poisson's ratio: expected a number above -1 and below 0.5, got {self.poisson:g}")

    @property
    def lame(self) -> tuple[float, float]:
        """Lame's first constant and the shear modulus, Pa."""
        young, poisson = self.young, self.poisson
        return young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson))

    def forces(self, moved: Points) -> Points:
        """(N, 3) N that the body exerts on its nodes, displaced by (N, 3) m."""
        gradient, stress = self._stress(moved)
        weights = 0.25 * self.mesh.volumes
        each = np.einsum("m,mgad,mgid->mai", weights, self.mesh.slopes @ stress, gradient, optimize=True)
        found = np.zeros(self.mesh.points.shape)
        np.add.at(found, self.mesh.elements, -each)
        return found

    def tangent(self, moved: Points) -> csc_matrix:
        """(3 N, 3 N) N/m: minus the derivative of `forces`."""
        gradient, stress = self._stress(moved)
        first, shear = self.lame
        slopes, weights = self.mesh.slopes, 0.25 * self.mesh.volumes[:, None]
        carried = slopes @ gradient.swapaxes(-1, -2)
        total = (weights[..., None, None] * carried).sum(axis=1)
        blocks = first * np.einsum("mai,mbj->maibj", total, total) / self.mesh.volumes[:, None, None, None, None]
        side = shear * weights[..., None, None] * carried
        blocks += np.einsum("mgbi,mgaj->maibj", side, carried, optimize=True)
        left = gradient @ gradient.swapaxes(-1, -2)
        inner = weights[..., None, None] * (slopes @ slopes.swapaxes(-1, -2))
        blocks += shear * np.einsum("mgab,mgij->maibj", inner, left, optimize=True)
        initial = (weights[..., None, None] * (slopes @ stress @ slopes.swapaxes(-1, -2))).sum(axis=1)
        blocks += np.einsum("mab,ij->maibj", initial, np.eye(3))
        return self.mesh.assembled(blocks.reshape(len(blocks), 30, 30), 3)

    def _stress(self, moved: Points) -> tuple[Floats, Floats]:
        """(M, 4, 3, 3): deformation gradients and second Piola-Kirchhoff stresses."""
        first, shear = self.lame
        unit = np.eye(3)
        gradient = np.einsum("mai,mgad->mgid", moved[self.mesh.elements], self.mesh.slopes, optimize=True) + unit
        strain = 0.5 * (gradient.swapaxes(-1, -2) @ gradient - unit)
        volume = np.trace(strain, axis1=2, axis2=3).mean(axis=1)
        return gradient, 2.0 * shear * strain + first * volume[:, None, None, None] * unit


def _values(inner: Perpoint) -> Floats:
    """(10,) shape functions at barycentric coordinates (4,)."""
    return np.concatenate([inner * (2.0 * inner - 1.0), 4.0 * inner[EDGES[:, 0]] * inner[EDGES[:, 1]]])


def _slopes(barycentric: Floats, inner: Perpoint) -> Floats:
    """(M, 10, 3) slopes of the shape functions at barycentric coordinates (4,)."""
    corners = (4.0 * inner - 1.0)[:, None] * barycentric
    start, end = EDGES.T
    middles = 4.0 * (inner[end][:, None] * barycentric[:, start] + inner[start][:, None] * barycentric[:, end])
    return np.concatenate([corners, middles], axis=1)


def _unit_masses() -> Floats:
    """(10, 10): the exact integrals of products of the shape functions over an element of volume one."""
    found = np.ones((10, 10))
    found[:4, :4] += 5.0 * np.eye(4)
    for index, (start, end) in enumerate(EDGES):
        beside = np.isin(np.arange(4), (start, end))
        found[:4, 4 + index] = found[4 + index, :4] = np.where(beside, -4.0, -6.0)
        shared = np.isin(EDGES, (start, end)).sum(axis=1)
        found[4:, 4 + index] = np.array([8.0, 16.0, 32.0])[shared]
    return found / 420.0
