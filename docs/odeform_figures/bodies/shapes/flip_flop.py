"""A left flip-flop that lies on its sole, its toes towards +x."""

import numpy as np
from scipy.interpolate import PchipInterpolator

from odeform.types import Perpoint, Points
from odeform_figures.bodies.signed_distance import capsule, mirrored, smooth_intersection, smooth_union, tube

__all__ = ["RANGES", "distance"]

RANGES = {"length": (0.88, 1.12), "width": (0.88, 1.12), "sole": (0.85, 1.25), "strap": (0.85, 1.2)}


def distance(
    points: Points, length: float = 1.0, width: float = 1.0, sole: float = 1.0, strap: float = 1.0
) -> Perpoint:
    """(N,) signed distance in metres at `points` (N, 3) m. The other arguments are factors on its proportions."""
    x, y, z = points.T
    half, thick = 0.13 * length, 0.022 * sole
    along = np.clip((x + half) / (2.0 * half), 0.0, 1.0)
    breadth = width * PchipInterpolator(
        [0.0, 0.08, 0.25, 0.5, 0.72, 0.9, 1.0], [0.026, 0.034, 0.037, 0.036, 0.049, 0.045, 0.034]
    )(along)
    middle = PchipInterpolator([0.0, 0.3, 0.55, 0.8, 1.0], [0.0, 0.0, -0.003, 0.005, 0.010])(along)
    outline = smooth_intersection(np.abs(y - middle) - breadth, np.abs(x) - half, 0.035)
    body = smooth_intersection(outline, np.abs(z - 0.5 * thick) - 0.5 * thick, 0.006)
    toe, radius = (0.068 * length, 0.004), 0.0085 * strap
    peak = thick + 0.026 * strap
    body = smooth_union(body, capsule(points, (*toe, 0.5 * thick), (*toe, peak), 0.0075 * strap), 0.006)
    side = 0.038 * width
    path = [(*toe, peak), (0.03 * length, 0.7 * side, peak + 0.014), (-0.03 * length, side, 0.6 * thick)]
    return smooth_union(body, tube(mirrored(points), path, radius, radius * 1.1), 0.007)
