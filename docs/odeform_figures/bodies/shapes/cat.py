"""A toy cat, sitting upright, that faces +x with its tail around its left side."""

from odeform.types import Perpoint, Points
from odeform_figures.bodies.signed_distance import capsule, ellipsoid, mirrored, smooth_union, tube

__all__ = ["RANGES", "distance"]

RANGES = {
    "girth": (0.88, 1.15),
    "height": (0.9, 1.12),
    "head": (0.88, 1.12),
    "ears": (0.75, 1.3),
    "tail": (0.85, 1.2),
}


def distance(
    points: Points, girth: float = 1.0, height: float = 1.0, head: float = 1.0, ears: float = 1.0, tail: float = 1.0
) -> Perpoint:
    """(N,) signed distance in metres at `points` (N, 3) m. The other arguments are factors on its proportions."""
    p, m, g = points, mirrored(points), girth
    top = 0.135 * height
    body = ellipsoid(p, (-0.022, 0, 0.058), (0.078 * g, 0.066 * g, 0.062))
    body = smooth_union(body, capsule(p, (-0.005, 0, 0.075), (0.035, 0, top), 0.056 * g, 0.044 * g), 0.03)
    body = smooth_union(body, ellipsoid(m, (-0.005, 0.052 * g, 0.042), (0.058, 0.030, 0.045)), 0.012)
    body = smooth_union(body, ellipsoid(m, (0.050, 0.062 * g, 0.016), (0.034, 0.019, 0.017)), 0.01)
    body = smooth_union(
        body, capsule(m, (0.052, 0.026 * g, top - 0.03), (0.070, 0.026 * g, 0.022), 0.024, 0.018), 0.012
    )
    body = smooth_union(body, ellipsoid(m, (0.083, 0.026 * g, 0.017), (0.030, 0.019, 0.018)), 0.01)
    path = [(-0.085, 0, 0.025), (-0.095, 0.05, 0.02), (-0.06, 0.105 * g, 0.018), (0.0, 0.118 * g, 0.018)]
    path.append((0.055 * tail, 0.112 * g, 0.022))
    body = smooth_union(body, tube(p, path, 0.020, 0.015), 0.014)
    return smooth_union(body, _head(p, m, top + 0.062, head, ears), 0.018)


def _head(p: Points, m: Points, height: float, size: float, ears: float) -> Perpoint:
    s = size
    head = ellipsoid(p, (0.060, 0, height), (0.050 * s, 0.060 * s, 0.048 * s))
    head = smooth_union(
        head, ellipsoid(m, (0.098 * s + 0.002, 0.013 * s, height - 0.014 * s), (0.020, 0.019, 0.016)), 0.012
    )
    tip = height + (0.052 + 0.030 * ears) * s
    ear = capsule(m, (0.058, 0.034 * s, height + 0.026 * s), (0.054, 0.050 * s, tip), 0.024 * s, 0.006)
    return smooth_union(head, ear, 0.008)
