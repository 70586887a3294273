"""Small vibrations of an elastic body around its rest: tangent stiffness and modes.

Tetrahedra are of Saint Venant-Kirchhoff material, as in the simulator. The tangent is taken where the body has settled
under its own weight, so that the stress of standing is part of it: a soft leg under load sways more easily.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import eigsh

from odeform.mechanics.hinges import hinge_stiffness
from odeform.types import Floats, Ints, Perpoint, Points

__all__ = ["ElasticModes", "elastic_forces", "elastic_modes", "rigid_modes", "tangent_stiffness"]

SHIFT = -2e3  # 1/s^2, where eigenvalues are searched from: below those of bodies that hardly stand
SPARE = 8  # eigenvectors computed besides those wanted; six are rigid


@dataclass(frozen=True, eq=False)
class ElasticModes:
    """K deformations that vibrate independently, without rigid motion."""

    eigenvalues: Float[np.ndarray, " modes"]
    """Squared angular frequencies in 1/s^2, ascending, none negative."""
    shapes: Float[np.ndarray, "modes nodes 3"]
    """Orthonormal under the nodal masses: metres per root kilogram."""


def tangent_stiffness(
    points: Points, elements: Ints, positions: Points, young: float, poisson: float, thickness: float = 0.0
) -> csc_matrix:
    """Computes (3 N, 3 N) N/m: minus the derivative of the elastic forces at `positions` (N, 3) m.

    `points` (N, 3) m are without stress, `young` is in Pa. `elements` are tetrahedra (M, 4), or the triangles (M, 3) of
    a shell of `thickness` metres, which bends as well, from the curvature of `points`.
    """
    shear = young / (2.0 * (1.0 + poisson))
    if elements.shape[1] == 4:
        lame = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
        sides, size = _sides(points, elements), 1.0
    else:
        lame = young * poisson / (1.0 - poisson**2)  # plane stress
        sides, size = _flattened(_sides(points, elements)), 3.0 * thickness
    volume = size * np.abs(np.linalg.det(sides)) / 6.0
    slopes = _slopes(sides)
    blocks = _blocks(slopes, np.asarray(positions, dtype=float)[elements], lame, shear)
    blocks *= volume[:, None, None, None, None]
    stiffness = _assembled(blocks, elements, len(points))
    if elements.shape[1] == 3:
        rigidity = young * thickness**3 / (12.0 * (1.0 - poisson**2))
        stiffness = stiffness + _assembled(*hinge_stiffness(points, elements, positions, rigidity), len(points))
    return stiffness


def elastic_forces(points: Points, elements: Ints, positions: Points, young: float, poisson: float) -> Points:
    """(N, 3) N: what tetrahedra (M, 4), without stress at `points` (N, 3) m, exert on their nodes at `positions`."""
    lame, shear = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson))
    sides = _sides(points, elements)
    volume = np.abs(np.linalg.det(sides)) / 6.0
    slopes = _slopes(sides)
    gradient, stress = _stress(slopes, np.asarray(positions, dtype=float)[elements], lame, shear)
    found = np.zeros(np.shape(points))
    np.add.at(found, elements, -volume[:, None, None] * (slopes @ (gradient @ stress).transpose(0, 2, 1)))
    return found


def _slopes(sides: Floats) -> Floats:
    """(M, a, d) slopes of the shape functions of elements with sides (M, d, d)."""
    inverse = np.linalg.inv(sides)
    return np.concatenate([-inverse.sum(axis=1)[:, None], inverse], axis=1)


def _stress(slopes: Floats, corners: Floats, lame: float, shear: float) -> tuple[Floats, Floats]:
    """(M, 3, d) deformation gradients, and (M, d, d) second Piola-Kirchhoff stresses."""
    gradient = np.einsum("mai,maj->mij", corners, slopes)
    unit = np.eye(slopes.shape[2])
    strain = 0.5 * (gradient.transpose(0, 2, 1) @ gradient - unit)
    return gradient, lame * np.trace(strain, axis1=1, axis2=2)[:, None, None] * unit + 2.0 * shear * strain


def _sides(points: Points, elements: Ints) -> Floats:
    """(M, 3, d) edges from the first corner, as columns."""
    corners = np.asarray(points, dtype=float)[elements]
    return (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)


def _flattened(sides: Floats) -> Floats:
    """(M, 3, 2) edges of triangles -> (M, 2, 2) in the plane of each."""
    return np.linalg.qr(sides)[1]


def _blocks(slopes: Floats, corners: Floats, lame: float, shear: float) -> Floats:
    """(M, a, 3, a, 3) stiffness of elements with a corners for each unit of their volume."""
    gradient, stress = _stress(slopes, corners, lame, shear)
    carried = slopes @ gradient.transpose(0, 2, 1)
    blocks = lame * np.einsum("mai,mbj->maibj", carried, carried)
    blocks += shear * np.einsum("mbi,maj->maibj", carried, carried)
    left = gradient @ gradient.transpose(0, 2, 1)
    blocks += shear * np.einsum("mab,mij->maibj", slopes @ slopes.transpose(0, 2, 1), left)
    initial = slopes @ stress @ slopes.transpose(0, 2, 1)
    return blocks + np.einsum("mab,ij->maibj", initial, np.eye(3))


def _assembled(blocks: Floats, elements: Ints, count: int) -> csc_matrix:
    """(3 N, 3 N) from the blocks (M, a, 3, a, 3) of elements (M, a)."""
    size = 3 * elements.shape[1]
    entries = (3 * elements[:, :, None] + np.arange(3)).reshape(len(elements), size)
    rows, columns = np.repeat(entries, size, axis=1).ravel(), np.tile(entries, (1, size)).ravel()
    return csc_matrix((blocks.ravel(), (rows, columns)), shape=(3 * count, 3 * count))


def rigid_modes(points: Points, masses: Perpoint) -> Float[np.ndarray, "6 nodes 3"]:
    """Returns shifts and small rotations of `points` (N, 3) m about their mass centre, orthonormal under `masses` (N,)
    kg."""
    arms = points - masses @ points / masses.sum()
    shifts = np.broadcast_to(np.eye(3)[:, None], (3, len(points), 3))
    turns = np.cross(np.eye(3)[:, None], arms[None])
    modes = np.concatenate([shifts, turns]).reshape(6, -1)
    weights = np.repeat(masses, 3)
    return np.linalg.solve(np.linalg.cholesky((modes * weights) @ modes.T), modes).reshape(6, -1, 3)


def elastic_modes(stiffness: csc_matrix, masses: Perpoint, positions: Points, count: int) -> ElasticModes:
    """The `count` softest modes of a body whose nodes of `masses` (N,) kg rest at `positions` (N, 3) m.

    Rigid motion is taken out exactly. A mode that the body's weight makes unstable counts as one without stiffness.
    """
    weights = np.repeat(masses, 3)
    symmetric = 0.5 * (stiffness + stiffness.T)
    start = np.random.default_rng(0).standard_normal(len(weights))  # or results differ from run to run
    _, vectors = eigsh(symmetric, count + SPARE, diags(weights).tocsc(), sigma=SHIFT, v0=start)
    rigid = rigid_modes(positions, masses).reshape(6, -1)
    vectors = vectors - rigid.T @ (rigid @ (weights[:, None] * vectors))
    root = np.sqrt(weights)[:, None]
    left, size, _ = np.linalg.svd(root * vectors, full_matrices=False)
    span: Floats = left[:, size > 0.1 * size[0]] / root
    eigenvalues, turn = np.linalg.eigh(span.T @ (symmetric @ span))
    shapes = (span @ turn[:, :count]).T.reshape(-1, len(masses), 3)
    return ElasticModes(np.maximum(eigenvalues[:count], 0.0), shapes)
