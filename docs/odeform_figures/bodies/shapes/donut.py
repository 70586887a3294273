"""A donut that lies flat."""

import numpy as np

from odeform.types import Perpoint, Points

__all__ = ["RANGES", "distance"]

RANGES = {"ring": (0.85, 1.2), "tube": (0.85, 1.15), "height": (0.85, 1.1)}


def distance(points: Points, ring: float = 1.0, tube: float = 1.0, height: float = 1.0) -> Perpoint:
    """(N,) signed distance in metres at `points` (N, 3) m. The other arguments are factors on its proportions."""
    radius = 0.028 * tube
    across = np.linalg.norm(points[:, :2], axis=1) - 0.052 * ring
    return np.hypot(across, (points[:, 2] - radius * height) / height) - radius
