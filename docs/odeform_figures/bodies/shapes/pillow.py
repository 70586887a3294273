"""A cushion with drawn-out corners that lies flat."""

import numpy as np

from odeform.types import Perpoint, Points
from odeform_figures.bodies.signed_distance import smooth_intersection

__all__ = ["RANGES", "distance"]

RANGES = {"length": (0.85, 1.15), "width": (0.85, 1.2), "fill": (0.8, 1.15), "corners": (0.6, 1.4)}

SEAM = 0.009  # m, half the thickness at the edges


def distance(
    points: Points, length: float = 1.0, width: float = 1.0, fill: float = 1.0, corners: float = 1.0
) -> Perpoint:
    """(N,) signed distance in metres at `points` (N, 3) m. The other arguments are factors on its proportions."""
    long, wide, high = 0.21 * length, 0.15 * width, 0.058 * fill
    x, y, z = points.T
    u, v = np.clip(np.abs([x / long, y / wide]), 0.0, 1.0)
    bulge = (1.0 - u**2.4) ** 0.6 * (1.0 - v**2.4) ** 0.6
    # between the corners the edges are drawn in, as on a filled bag
    edges = np.maximum(
        np.abs(x) - long * (1.0 - 0.09 * corners * (1.0 - v**2)),
        np.abs(y) - wide * (1.0 - 0.11 * corners * (1.0 - u**2)),
    )
    # the lower side is flatter
    half = np.where(z > 0.0, 1.0, 0.75) * high * bulge + SEAM
    return smooth_intersection(0.7 * (np.abs(z) - half), edges, 0.012)
