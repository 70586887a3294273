"""An error on a surface: bands of a colour scale, each a part of the mesh."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from odeform.types import Faces, Floats, Ints, Perpoint, Points

__all__ = ["BANDS", "Spread", "bands_of", "levels_of", "scale_for"]

# eight even samples of viridis: even steps to the eye, also in grey and to the colour-blind
BANDS = (
    (68, 1, 84),
    (70, 50, 127),
    (54, 92, 141),
    (39, 127, 142),
    (31, 161, 135),
    (74, 194, 109),
    (159, 218, 58),
    (253, 231, 37),
)
NEAR = 3


class Spread:
    """Carries values at some points (N, 3) of a surface to others (M, 3) on it: means of the nearest, by distance."""

    def __init__(self, given: Points, wanted: Points) -> None:
        distance, self._index = KDTree(given).query(wanted, k=min(NEAR, len(given)))
        share = 1.0 / np.maximum(distance, 1e-9)
        self._share: Float[np.ndarray, "wanted near"] = share / share.sum(axis=1, keepdims=True)

    def __call__(self, values: Perpoint) -> Perpoint:
        return (self._share * values[self._index]).sum(axis=1)


def levels_of(values: Perpoint, top: float) -> Ints:
    """(N,) the band of each value, the last open above `top`."""
    return np.clip((values / top * len(BANDS)).astype(int), 0, len(BANDS) - 1)


def bands_of(values: Perpoint, faces: Faces, top: float) -> list[tuple[Ints, Ints] | None]:
    """A mesh by the band that each face's mean value falls in.

    For each band the vertices (M,) it uses and its faces (F, 3) among them; None where it is empty.
    """
    level = levels_of(values[faces].mean(axis=1), top)
    parts: list[tuple[Ints, Ints] | None] = []
    for band in range(len(BANDS)):
        chosen = faces[level == band]
        used, local = np.unique(chosen, return_inverse=True)
        parts.append((used, local.reshape(-1, 3)) if len(chosen) else None)
    return parts


def scale_for(errors_mm: Floats) -> float:
    """A round top of the scale, in mm, for RMS errors over time: 1, 2 or 5 times a power of ten.

    Three times the largest RMS over the coordinates holds nearly all points at the worst moment.
    """
    largest = 3.0 * float(np.nanmax(errors_mm, initial=0.0))
    if largest <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(largest))
    return float(next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= largest * (1.0 - 1e-9)))
