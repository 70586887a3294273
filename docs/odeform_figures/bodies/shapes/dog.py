"""A toy dog with hanging ears, standing, that faces +x."""

from odeform.types import Perpoint, Points
from odeform_figures.bodies.signed_distance import capsule, ellipsoid, mirrored, smooth_union, tube

__all__ = ["RANGES", "distance"]

RANGES = {
    "length": (0.88, 1.15),
    "girth": (0.88, 1.12),
    "legs": (0.8, 1.1),
    "muzzle": (0.75, 1.3),
    "ears": (0.75, 1.25),
}


def distance(
    points: Points, length: float = 1.0, girth: float = 1.0, legs: float = 1.0, muzzle: float = 1.0, ears: float = 1.0
) -> Perpoint:
    """(N,) signed distance in metres at `points` (N, 3) m. The other arguments are factors on its proportions."""
    p, m, x, g = points, mirrored(points), 0.095 * length, girth
    back = 0.09 * legs + 0.045
    body = capsule(p, (-x, 0, back), (x, 0, back + 0.006), 0.053 * g, 0.060 * g)
    body = smooth_union(
        body, capsule(m, (x, 0.034 * g, back - 0.02), (x + 0.01, 0.040 * g, 0.024), 0.034, 0.025), 0.016
    )
    body = smooth_union(body, ellipsoid(m, (x + 0.022, 0.040 * g, 0.020), (0.036, 0.027, 0.021)), 0.010)
    body = smooth_union(
        body, capsule(m, (-x, 0.034 * g, back - 0.01), (-x - 0.012, 0.042 * g, 0.024), 0.042, 0.025), 0.016
    )
    body = smooth_union(body, ellipsoid(m, (-x + 0.004, 0.042 * g, 0.020), (0.036, 0.027, 0.021)), 0.010)
    tail = [(-x - 0.035, 0, back + 0.025), (-x - 0.075, 0, back + 0.055), (-x - 0.085, 0, back + 0.105)]
    body = smooth_union(body, tube(p, tail, 0.019, 0.012), 0.018)
    body = smooth_union(body, capsule(p, (x, 0, back + 0.02), (x + 0.045, 0, back + 0.085), 0.048 * g, 0.044), 0.03)
    return smooth_union(body, _head(p, m, (x + 0.062, 0, back + 0.108), muzzle, ears), 0.018)


def _head(p: Points, m: Points, at: tuple[float, float, float], muzzle: float, ears: float) -> Perpoint:
    x, _, z = at
    head = ellipsoid(p, (x, 0, z), (0.058, 0.054, 0.052))
    nose = x + 0.045 + 0.050 * muzzle
    head = smooth_union(head, capsule(p, (x + 0.030, 0, z - 0.014), (nose, 0, z - 0.020), 0.034, 0.026), 0.018)
    head = smooth_union(head, ellipsoid(p, (nose + 0.020, 0, z - 0.006), (0.013, 0.015, 0.012)), 0.006)
    ear = ellipsoid(m, (x - 0.014, 0.060, z - 0.018 - 0.022 * ears), (0.026, 0.013, 0.030 + 0.026 * ears))
    return smooth_union(head, ear, 0.010)
