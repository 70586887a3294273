"""Rigid motion: rotations, rotation vectors, and the best rigid fit between two shapes. All float64 NumPy.

`rotation_from_vector` is not scipy's, which is faster but rounds differently: packed data sets and motions are
reproduced bit for bit.
"""

import numpy as np
from jaxtyping import Float

from odeform.types import Floats, Perpoint, Rotations, Vectors

__all__ = [
    "best_rigid",
    "body_spin",
    "is_rotation",
    "rotation_from_vector",
    "rotation_z",
    "unwrapped_vectors",
    "vector_from_rotation",
]

UNTURNED = np.eye(3)
ACROSS = np.array(
    [[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]], dtype=float
)
"""(3, 9): w @ ACROSS are the entries of the matrix of v -> w x v."""


def rotation_z(angle: float) -> Rotations:
    """Computes the rotation (3, 3) by `angle` radians about the vertical axis."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def is_rotation(matrix: Floats) -> bool:
    """Whether a matrix is (3, 3), orthonormal within 1e-6, and not a reflection."""
    square = matrix.shape == (3, 3) and np.isfinite(matrix).all()
    return bool(square and np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6) and np.linalg.det(matrix) > 0.0)


def rotation_from_vector(vector: Vectors) -> Rotations:
    """Maps (..., 3) rotation vectors in radians, of any length to (..., 3, 3) (Rodrigues)."""
    vector = np.asarray(vector, dtype=float)
    # by few calls: of one vector, they take longer than the arithmetic
    angle = np.sqrt((vector * vector).sum(axis=-1))[..., None, None]
    skew = (vector @ ACROSS).reshape(*vector.shape, 3)
    half = _sinc(angle / (2 * np.pi))
    return UNTURNED + _sinc(angle / np.pi) * skew + 0.5 * half**2 * (skew @ skew)


def _sinc(x: Floats) -> Floats:
    """Computes `np.sinc`, sin(pi x) / (pi x): exact where x vanishes."""
    angle = np.pi * x
    safe = np.where(angle, angle, 1e-20)
    return np.sin(safe) / safe


def body_spin(vector: Float[np.ndarray, "*#batch 3"], change: Float[np.ndarray, "*#batch 3"]) -> Vectors:
    """The rotation vector (..., 3) in body axes by which R(w) changes, to first order, as w (..., 3) does by `change`.

    The right Jacobian of SO(3) (Chirikjian 2012, Stochastic Models, Information Theory, and Lie Groups 2, 10.86).
    """
    angle = np.linalg.norm(vector, axis=-1)[..., None]
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    one = np.where(small, 0.5, (1.0 - np.cos(safe)) / safe**2)
    two = np.where(small, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    across = np.cross(vector, change)
    return change - one * across + two * np.cross(vector, across)


def vector_from_rotation(rotation: Rotations) -> Vectors:
    """Maps (..., 3, 3) to (..., 3) rotation vectors of angle at most pi, through unit quaternions for accuracy near
    pi."""
    from scipy.spatial.transform import Rotation

    flat = Rotation.from_matrix(np.asarray(rotation, dtype=float).reshape(-1, 3, 3)).as_rotvec()
    return flat.reshape(*rotation.shape[:-2], 3)


def unwrapped_vectors(rotations: Rotations) -> Vectors:
    """(T, 3, 3) -> (T, 3) rotation vectors without jumps: each frame takes the number of turns nearest to the last one.

    The rotation vector of a ball that rolls over several times grows past pi instead of flipping back.
    """
    vectors = vector_from_rotation(rotations)
    for index in range(1, len(vectors)):
        angle = np.linalg.norm(vectors[index])
        if angle < 1e-9:
            # whole turns have no axis: keep the last one
            last = np.linalg.norm(vectors[index - 1])
            axis = vectors[index - 1] / last if last > 1e-9 else np.zeros(3)
            vectors[index] = axis * 2 * np.pi * round(last / (2 * np.pi))
            continue
        axis = vectors[index] / angle
        turns = np.round((vectors[index - 1] @ axis - angle) / (2 * np.pi))
        vectors[index] = axis * (angle + 2 * np.pi * turns)
    return vectors


def best_rigid(
    rest: Float[np.ndarray, "*#batch points 3"], moved: Float[np.ndarray, "*batch points 3"], weights: Perpoint
) -> tuple[Rotations, Vectors]:
    """Finds the weighted least-squares rigid motion of `rest` (N, 3) or (..., N, 3) onto `moved` (..., N, 3) (Kabsch
    1976).

    Returns rotations R (..., 3, 3) and shifts p (..., 3) of the weighted centroid c:
    moved ~ R (rest - c) + c + p. `weights` (N,) sum to 1.
    """
    rest, moved = np.asarray(rest, dtype=float), np.asarray(moved, dtype=float)
    centre, centres = (np.einsum("n,...ni->...i", weights, points) for points in (rest, moved))
    cross = np.einsum("n,...ni,...nj->...ij", weights, moved - centres[..., None, :], rest - centre[..., None, :])
    u, _, vt = np.linalg.svd(cross)
    sign = np.ones(u.shape[:-1])
    sign[..., 2] = np.linalg.det(u @ vt)
    return (u * sign[..., None, :]) @ vt, centres - centre
