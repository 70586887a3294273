"""Errors on a surface as bands of a color scale. Each band is a mesh of its own."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from odeform.types import Faces, Floats, Ints, Perpoint, Points

__all__ = ["BANDS", "NearestInterpolation", "band_indices", "scale_for", "split_into_bands"]

# eight even samples of viridis: perceptually uniform, also in grayscale and for color-blind readers
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
        """Values (M,) at the targets for `values` (N,) at the sources."""
        return (self._weights * values[self._index]).sum(axis=1)


def band_indices(values: Perpoint, top: float) -> Ints:
    """The band (N,) of each value. The last band also holds values above `top`."""
    return np.clip((values / top * len(BANDS)).astype(int), 0, len(BANDS) - 1)


def split_into_bands(values: Perpoint, faces: Faces, top: float) -> list[tuple[Ints, Ints] | None]:
    """Split the faces of a mesh by the band of their mean value.

    For each band: the vertices (M,) that it uses, and its faces (F, 3) indexing these; None for an empty band.
    """
    level = band_indices(values[faces].mean(axis=1), top)
    parts: list[tuple[Ints, Ints] | None] = []
    for band in range(len(BANDS)):
        chosen = faces[level == band]
        used, local = np.unique(chosen, return_inverse=True)
        parts.append((used, local.reshape(-1, 3)) if len(chosen) else None)
    return parts


def scale_for(errors_mm: Floats) -> float:
    """A round upper end of the color scale, in mm, for RMS errors (T,) over time: 1, 2 or 5 times a power of ten.

    It is at least three times the largest error, so that nearly all points stay below it even at the worst time.
    NaN is ignored.
    """
    largest = 3.0 * float(np.nanmax(errors_mm, initial=0.0))
    if largest <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(largest))
    return float(next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= largest * (1.0 - 1e-9)))
