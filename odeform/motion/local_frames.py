"""How the neighbourhood of each point deforms: a local frame of axes, carried along by the deformation gradient.

A frame Q = [q1 q2 q3] stands at each point of the body at rest. D(x) = x + sum_k c_k phi_k(x) carries an axis q to
f = q + sum_k c_k (grad phi_k) q, so that the gradient is F = P Q^T with P = [f1 f2 f3], and a covariance S becomes
F S F^T = P (Q^T S Q) P^T.

Data on a surface determine how its tangents move, but not its normal. There q3 is the unit normal of the trained
surface nearest to the point, and f3 the unit normal of the deformed one, along cof(F) q3: the thickness is kept, as in
the shell theory of Kirchhoff and Love. Data with interior points give all three axes.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.geometry.normals import nearest_normals
from odeform.motion.reduced_space import ReducedSpace
from odeform.types import Matrices, Perpoint, Points, Vectors

__all__ = ["BOUND", "Axes", "LocalFrames", "evaluate_local_frames", "gradients", "moved_covariances"]

BOUND = 4.0
"""No length at a point grows or shrinks by more than this factor.

This is far above what soft bodies do (the bundled models stretch by less than a tenth), so that trained motions are
unchanged; and no prediction, however far outside the trained range, spreads a splat over the scene.
"""

Axes = Float[np.ndarray, "3 3 points"]
"""[j, i, n]: component i of axis j at point n. Points come last: each number of a frame is one contiguous array."""


@dataclass(frozen=True, eq=False)
class LocalFrames:
    """`rest` (3, 3, N) the axes Q at rest, canonical; `slopes` (K, M, 3, N) d phi along the first M of them; float32.

    M is 2 on a surface, 3 in a volume. 24 K bytes a point on a surface: 67 MB for 200,000 points and 14 modes.
    """

    rest: Axes
    slopes: Float[np.ndarray, "modes followed 3 points"]

    def carried(self, coefficients: Float[np.ndarray, " modes"]) -> Axes:
        """Returns the axes P under the deformation of `coefficients` (K,): finite and within `BOUND` for any values."""
        modes, followed, _, count = self.slopes.shape
        out = np.empty((3, 3, count), dtype=np.float32)
        with np.errstate(over="ignore", invalid="ignore"):
            moved = coefficients.astype(np.float32) @ self.slopes.reshape(modes, -1)
            np.add(self.rest[:followed], moved.reshape(followed, 3, count), out=out[:followed])
            area = _cross(out[0], out[1])
            wild = ~_bounded(out[:followed], area)
        if wild.any():
            out[:followed, :, wild] = _clipped(out[:followed, :, wild])
            area[:, wild] = _cross(out[0][:, wild], out[1][:, wild])
        if followed == 2:
            np.divide(area, np.sqrt(_dot(area, area)), out=out[2])
        return out


def evaluate_local_frames(rest: Points, space: ReducedSpace) -> LocalFrames:
    """Evaluates local frames at the canonical points `rest` (N, 3) metres."""
    if space.surface is None:
        axes = np.broadcast_to(np.eye(3)[..., None], (3, 3, len(rest)))
    else:
        axes = _completed(nearest_normals(space.surface, rest))
    followed = axes if space.surface is None else axes[:2]
    return LocalFrames(axes.astype(np.float32), space.basis.slopes(rest, followed.transpose(2, 0, 1)))


def gradients(rest: Axes, carried: Axes) -> Matrices:
    """F = P Q^T, (N, 3, 3), from the axes Q at rest and P where they are carried."""
    return np.einsum("jin,jkn->nik", carried, rest)


def moved_covariances(local: Axes, carried: Axes) -> Matrices:
    """Returns P (Q^T S Q) P^T, (N, 3, 3), from `local` (3, 3, N), the covariances in the axes of their local frames."""
    half = np.einsum("jkn,kin->jin", local, carried)
    return np.einsum("jin,jln->nil", carried, half)


Rows = Float[np.ndarray, "3 points"]
Followed = Float[np.ndarray, "followed 3 points"]


def _cross(one: Rows, other: Rows) -> Rows:
    out = np.empty_like(one)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(one[j] * other[k], one[k] * other[j], out=out[i])
    return out


def _dot(one: Rows, other: Rows) -> Perpoint:
    return np.einsum("in,in->n", one, other)


def _bounded(axes: Followed, area: Rows) -> np.ndarray:
    """(N,) bool: where all singular values are certainly within `BOUND`; False where they are not finite.

    With the sum of their squares q, the largest is at most sqrt(q). The smallest is the area over the largest for two
    axes, and for three the volume over the product of the others, which is at most q / 2.
    """
    square = np.einsum("jin,jin->n", axes, axes)
    smallest = _dot(area, area) * BOUND**2 if len(axes) == 2 else _dot(area, axes[2]) * 2.0 * BOUND
    return (square <= BOUND**2) & (square < smallest)


def _clipped(axes: Followed) -> Followed:
    """The nearest axes whose singular values are within `BOUND`; in double precision, for the few that need it."""
    matrices = np.where(np.isfinite(axes), axes, 0.0).astype(float).transpose(2, 1, 0)
    u, size, vt = np.linalg.svd(matrices, full_matrices=False)
    return ((u * np.clip(size, 1.0 / BOUND, BOUND)[:, None]) @ vt).transpose(2, 1, 0)


def _completed(normals: Vectors) -> Axes:
    """Orthonormal (3, 3, N) with the third axis along `normals` (N, 3) (Duff et al. 2017, JCGT 6(1))."""
    x, y, z = normals.T
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    one = np.stack([1.0 + sign * x**2 * a, sign * b, -sign * x])
    two = np.stack([b, sign + y**2 * a, -y])
    return np.stack([one, two, normals.T])
