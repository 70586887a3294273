"""The two ways to write the ellipsoid of a splat: its covariance, or the lengths and the turn of its axes.

Quaternions have w first.
"""

import numpy as np
from jaxtyping import Float

from odeform.types import Floats, Ints, Points, Rotations

__all__ = ["axes_from_covariances", "covariances_from_axes", "with_fourth"]

Quaternions = Float[np.ndarray, "points 4"]
Covariances = Float[np.ndarray, "points 3 3"]


def covariances_from_axes(scales: Points, quaternions: Quaternions) -> Covariances:
    """(N, 3) standard deviations in m and (N, 4) quaternions -> (N, 3, 3) m^2.

    Quaternions of any length count by their direction; one of no length is no turn.
    """
    half = _rotations(quaternions) * np.asarray(scales, dtype=float)[:, None, :]
    return half @ half.swapaxes(1, 2)


def axes_from_covariances(covariances: Covariances) -> tuple[Points, Quaternions]:
    """(N, 3, 3) m^2 -> (N, 3) standard deviations in m and (N, 4) unit quaternions, w not negative."""
    from scipy.spatial.transform import Rotation

    variances, axes = np.linalg.eigh(np.asarray(covariances, dtype=float))
    axes[:, :, 0] *= np.where(np.linalg.det(axes) < 0.0, -1.0, 1.0)[:, None]
    quaternions = Rotation.from_matrix(axes).as_quat(canonical=True, scalar_first=True)
    # rounding leaves the variance of a flat splat a little under zero
    return np.sqrt(np.maximum(variances, 0.0)), quaternions


def with_fourth(others: Points, place: Ints) -> Quaternions:
    """Unit quaternions (N, 4), in the order of the file, which keeps (N, 3) components and the place of the other.

    The one left out is taken as positive, as q and -q are one turn.
    """
    fourth = np.sqrt(np.maximum(0.0, 1.0 - (others**2).sum(axis=1)))
    out = np.empty((len(others), 4))
    for index in range(4):
        rows = place == index
        out[rows] = np.insert(others[rows], index, fourth[rows], axis=1)
    return out


def _rotations(quaternions: Quaternions) -> Rotations:
    quaternions = np.asarray(quaternions, dtype=float)
    length = np.linalg.norm(quaternions, axis=1, keepdims=True)
    unit = np.where(length <= 1e-12, [1.0, 0.0, 0.0, 0.0], quaternions / np.maximum(length, 1e-12))
    w, x, y, z = unit.T
    rows: list[Floats] = [
        *(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        *(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        *(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    ]
    return np.stack(rows, axis=1).reshape(-1, 3, 3)
