"""Bending of shells: the hinges between neighbouring triangles, which rest at the angle that they are made with."""

import numpy as np
from jaxtyping import Float

from odeform.mechanics.rotations import skew
from odeform.types import Floats, Ints, Points

__all__ = ["hinge_stiffness"]

EDGES = np.array([[-1.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 1.0]])
"""The corners of a hinge -> its edges from the first one."""


def hinge_stiffness(
    points: Points, faces: Ints, positions: Points, rigidity: float
) -> tuple[Float[np.ndarray, "hinges 4 3 4 3"], Ints]:
    """Compute the stiffness in N/m of the hinges of a plate of `rigidity` N m at `positions` (N, 3) m, and their
    corners (H, 4): the ends of the common edge, and the tips of both triangles.

    `points` (N, 3) m are without stress, `faces` (M, 3) triangles. The energy of a hinge is rigidity / area times
    (cos(rest) |L|^2 / 2 - sin(rest) sine), where L is the cotangent Laplacian (Bergou et al. 2006, A quadratic bending
    model for inextensible surfaces), rest the angle between the normals at `points`, and sine a cubic polynomial that
    stands for the sine of the angle (Garg et al. 2007, Cubic shells). Both as MuJoCo 4.0 has them.
    """
    corners = _corners(faces)
    edge, first, second = _edges(points, corners)
    normals = np.stack([np.cross(edge, first), np.cross(second, edge)])
    double = np.linalg.norm(normals, axis=2)  # twice the areas of both triangles
    length, (one, other) = np.linalg.norm(edge, axis=1), double
    cosine = (normals[0] * normals[1]).sum(axis=1) / (one * other)
    sine = (normals[0] * second).sum(axis=1) * length / (one * other)
    scale = 2.0 * rigidity / (one + other)

    laplacian = _laplacian(edge, first, second, double)
    blocks = (scale * cosine)[:, None, None] * laplacian[:, :, None] * laplacian[:, None, :]
    curved = (scale * sine * length**3 / (one * other))[:, None, None, None, None] * _curvature(positions, corners)
    return np.einsum("hab,ij->haibj", blocks, np.eye(3)) - curved, corners


def _corners(faces: Ints) -> Ints:
    """(H, 4) for each edge between two triangles, its ends and the tips of both."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    pairs = np.flatnonzero((edges[order[1:]] == edges[order[:-1]]).all(axis=1))
    one, other = order[pairs], order[pairs + 1]
    tips = [faces[e // 3, (e % 3 + 2) % 3] for e in (one, other)]
    return np.concatenate([edges[one], np.stack(tips, axis=1)], axis=1)


def _edges(points: Points, corners: Ints) -> Floats:
    """(3, H, 3) m from the first corner to the others."""
    return np.einsum("ea,hai->ehi", EDGES, np.asarray(points, dtype=float)[corners])


def _laplacian(edge: Floats, first: Floats, second: Floats, double: Floats) -> Floats:
    """(H, 4) cotangent weights of the corners."""
    at_begin = [(edge * side).sum(axis=1) / area for side, area in zip((first, second), double, strict=True)]
    at_end = [(edge * (edge - side)).sum(axis=1) / area for side, area in zip((first, second), double, strict=True)]
    tips = [-begin - end for begin, end in zip(at_begin, at_end, strict=True)]
    return np.stack([sum(at_end), sum(at_begin), *tips], axis=1)


def _curvature(positions: Points, corners: Ints) -> Floats:
    """(H, 4, 3, 4, 3) second derivative of six times the volume that the corners span."""
    edge, first, second = (skew(side) for side in _edges(positions, corners))
    none = np.zeros_like(edge)
    by_edges = np.array([[none, -second, first], [second, none, -edge], [-first, edge, none]])
    return np.einsum("ea,efhij,fb->haibj", EDGES, by_edges, EDGES)
