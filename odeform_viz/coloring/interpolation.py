"""Values carried from one discretization of a surface to another."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from odeform.types import Perpoint, Points

__all__ = ["NearestInterpolation"]

NEIGHBORS = 3


class NearestInterpolation:
    """Interpolates values from points `source` (N, 3) to points `target` (M, 3), both on one surface.

    Each value is the mean of the three nearest, weighted by inverse distance.
    """

    def __init__(self, source: Points, target: Points) -> None:
        distance, self._index = KDTree(source).query(target, k=min(NEIGHBORS, len(source)))
        weights = 1.0 / np.maximum(distance, 1e-9)
        self._weights: Float[np.ndarray, "target near"] = weights / weights.sum(axis=1, keepdims=True)

    def __call__(self, values: Perpoint) -> Perpoint:
        """Returns values (M,) at the targets for `values` (N,) at the sources."""
        return (self._weights * values[self._index]).sum(axis=1)
