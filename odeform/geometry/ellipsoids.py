"""Ellipsoids of Gaussian splats: as covariances, or as scales and rotations of their axes.

Quaternions have w first.
"""

import numpy as np
from jaxtyping import Float

from odeform.types import Ints, Points

__all__ = ["axes_from_covariances", "covariances_from_axes", "with_fourth"]

Quaternions = Float[np.ndarray, "points 4"]
Covariances = Float[np.ndarray, "points 3 3"]

IDENTITY = (1.0, 0.0, 0.0, 0.0)
BLOCK = 1 << 16  # splats at a time: intermediate results are several times as large as the result


def covariances_from_axes(scales: Points, quaternions: Quaternions) -> Covariances:
    """Maps (N, 3) standard deviations in m and (N, 4) quaternions to (N, 3, 3) m^2.

    Quaternions are normalised; one of zero length is the identity, one that is not finite gives a covariance that is
    not.
    """
    out = np.empty((len(scales), 3, 3))
    for start in range(0, len(scales), BLOCK):
        rows = slice(start, start + BLOCK)
        out[rows] = _covariances(np.asarray(scales[rows], dtype=float), np.asarray(quaternions[rows], dtype=float))
    return out


def _covariances(scales: Points, quaternions: Quaternions) -> Covariances:
    from scipy.spatial.transform import Rotation

    length = np.linalg.norm(quaternions, axis=1, keepdims=True)
    usable = np.isfinite(length) & (length > 1e-12)
    rotations = Rotation.from_quat(np.where(usable, quaternions, IDENTITY), scalar_first=True).as_matrix()
    rotations[~np.isfinite(length[:, 0])] = np.nan
    half = rotations * scales[:, None, :]
    return half @ half.swapaxes(1, 2)


def axes_from_covariances(covariances: Covariances) -> tuple[Points, Quaternions]:
    """Maps (N, 3, 3) m^2 to (N, 3) standard deviations in m and (N, 4) unit quaternions with w >= 0."""
    from scipy.spatial.transform import Rotation

    variances, axes = np.linalg.eigh(np.asarray(covariances, dtype=float))
    axes[:, :, 0] *= np.where(np.linalg.det(axes) < 0.0, -1.0, 1.0)[:, None]
    quaternions = Rotation.from_matrix(axes).as_quat(canonical=True, scalar_first=True)
    # rounding leaves the variance of a flat splat slightly below zero
    return np.sqrt(np.maximum(variances, 0.0)), quaternions


def with_fourth(others: Points, index: Ints) -> Quaternions:
    """Maps (N, 3) components of unit quaternions and the `index` (N,) of the missing one to (N, 4) in the same order.

    The missing component is taken as positive: q and -q are the same rotation.
    """
    fourth = np.sqrt(np.maximum(0.0, 1.0 - (others**2).sum(axis=1)))
    out = np.empty((len(others), 4))
    for position in range(4):
        rows = index == position
        out[rows] = np.insert(others[rows], position, fourth[rows], axis=1)
    return out
