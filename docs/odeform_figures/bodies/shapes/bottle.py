"""A bottle with shoulders, a neck and a cap, that stands upright."""

import numpy as np
from scipy.interpolate import PchipInterpolator

from odeform.types import Perpoint, Points
from odeform_figures.bodies.signed_distance import smooth_intersection, smooth_union

__all__ = ["RANGES", "distance"]

RANGES = {"girth": (0.85, 1.2), "height": (0.85, 1.15), "waist": (0.85, 1.08), "neck": (0.85, 1.25)}


def distance(
    points: Points, girth: float = 1.0, height: float = 1.0, waist: float = 1.0, neck: float = 1.0
) -> Perpoint:
    """(N,) signed distance in metres at `points` (N, 3) m. The other arguments are factors on its proportions."""
    heights = np.array([0.0, 0.02, 0.065, 0.110, 0.128, 0.148, 0.163, 0.175, 0.200]) * height
    radii = np.array([0.037, 0.0385, 0.0375 * waist, 0.0385, 0.0365, 0.026, 0.016 * neck, 0.0145 * neck, 0.0145 * neck])
    radii[:6] *= girth
    body = _turned(points, heights, radii, 0.012)
    cap = np.array([0.176, 0.206]) * height
    return smooth_union(body, _turned(points, cap, np.full(2, 0.0195 * neck), 0.006), 0.003)


def _turned(points: Points, heights: Perpoint, radii: Perpoint, rounding: float) -> Perpoint:
    """A body of revolution whose radius is interpolated over the height, with rounded ends."""
    z = points[:, 2]
    side = np.linalg.norm(points[:, :2], axis=1) - PchipInterpolator(heights, radii)(
        np.clip(z, heights[0], heights[-1])
    )
    return smooth_intersection(side, np.maximum(heights[0] - z, z - heights[-1]), rounding)
