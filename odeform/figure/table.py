"""Motions on a grid of parameters, as few numbers: a mean, patterns over time and coordinates, and weights of these.

Between the values of the grid weights are interpolated by cubics, and so are coordinates between frames. `figure.js`
does the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from jaxtyping import Float, Int16

from odeform.types import Arrays, Floats

__all__ = ["Table", "compressed", "cubic_weights", "quantised"]

FULL = 32767  # of 16 bits
SKETCHED = 32  # patterns that are computed beyond the largest number of them, and dropped


@dataclass(frozen=True, eq=False)
class Table:
    """Coordinates y (T, D) of motions at places on sliders: (mean + sum_r weight_r pattern_r) / scale."""

    counts: tuple[int, ...]
    """Values of each parameter, evenly spaced along its slider."""
    scale: Float[np.ndarray, " coordinates"]
    """(D,) by which coordinates become metres."""
    mean: Float[np.ndarray, "times coordinates"]
    patterns: Int16[np.ndarray, "rank times coordinates"]
    sizes: Float[np.ndarray, " rank"]
    """(R,) of one step of a pattern times one step of a weight, in metres."""
    weights: Int16[np.ndarray, "grid rank"]

    def at(self, places: Float[np.ndarray, " sweeps"]) -> Floats:
        """Computes y (T, D) at places (A,) on the sliders, from 0 to 1."""
        by = product_weights(places, self.counts) @ self.weights
        return (self.mean + np.tensordot(by * self.sizes, self.patterns, axes=1)) / self.scale

    def arrays(self) -> Arrays:
        """What the page holds of it, by name."""
        wide = {"scale": self.scale, "mean": self.mean, "sizes": self.sizes}
        narrow = {"patterns": self.patterns, "weights": self.weights}
        return {name: array.astype(np.float32) for name, array in wide.items()} | narrow


def cubic_weights(place: float, count: int) -> Float[np.ndarray, " count"]:
    """Returns weights (C,) of values at 0, 1 ... C - 1 in the one at `place`, between them: Catmull-Rom.

    Values before the first and after the last continue the line through the nearest two.
    """
    weights = np.zeros(count)
    if count == 1:
        weights[0] = 1.0
        return weights
    first = min(max(int(place), 0), count - 2)
    x = place - first
    terms = (
        x * (x * (1.0 - 0.5 * x) - 0.5),
        1.0 + x * x * (1.5 * x - 2.5),
        x * (0.5 + x * (2.0 - 1.5 * x)),
        0.5 * x * x * (x - 1.0),
    )
    for index, term in enumerate(terms, first - 1):
        if 0 <= index < count:
            weights[index] += term
        else:
            end, inner = (0, 1) if index < 0 else (count - 1, count - 2)
            weights[end] += 2.0 * term
            weights[inner] -= term
    return weights


def product_weights(places: Float[np.ndarray, " sweeps"], counts: Sequence[int]) -> Float[np.ndarray, " grid"]:
    """Returns weights (G,) of a grid of `counts` values, the last parameter changing fastest, at `places` (A,)."""
    each = [cubic_weights(place * (count - 1), count) for place, count in zip(places, counts, strict=True)]
    return reduce(np.multiply.outer, each, np.ones(())).ravel()


def quantised(values: Float[np.ndarray, "rows _"]) -> tuple[Int16[np.ndarray, "rows _"], Float[np.ndarray, " rows"]]:
    """Rounds each row (R, M) to 16 bits; returns them and the size (R,) of one step."""
    steps = np.maximum(np.abs(values).max(axis=1, initial=0.0), np.finfo(np.float32).tiny) / FULL
    return np.rint(values / steps[:, None]).astype(np.int16), steps


def compressed(
    motions: Float[np.ndarray, "grid times coordinates"],
    counts: tuple[int, ...],
    scale: Float[np.ndarray, " coordinates"],
    tolerance: float,
    most: int,
) -> Table:
    """Compresses motions y (G, T, D) to the fewest patterns, at most `most`, that leave out at most `tolerance` metres
    (RMS over motions, frames and the three axes)."""
    grid, times, coordinates = motions.shape
    flat = (motions * scale.astype(np.float32)).reshape(grid, -1)
    mean = flat.mean(axis=0)
    flat -= mean
    weights, patterns = _principal(flat, min(most + SKETCHED, grid, flat.shape[1]))
    total = float(np.einsum("gi,gi->", flat, flat, dtype=float))
    left = total - np.concatenate([[0.0], np.cumsum(np.square(weights, dtype=float).sum(axis=0))])
    enough = np.flatnonzero(left <= tolerance**2 * 3.0 * grid * times)
    rank = max(min(int(enough[0]) if len(enough) else most, most, weights.shape[1]), 1)
    whole, steps = quantised(patterns[:rank])
    by, by_steps = quantised(weights[:, :rank].T)
    mean = mean.reshape(times, coordinates).astype(float)
    return Table(counts, scale, mean, whole.reshape(rank, times, coordinates), steps * by_steps, by.T)


def _principal(
    rows: Float[np.ndarray, "grid entries"], count: int
) -> tuple[Float[np.ndarray, "grid count"], Float[np.ndarray, "count entries"]]:
    """Principal components of (G, E), largest first, by a random range finder (Halko et al. 2011, algorithm 4.4)."""
    draws = np.random.default_rng(0).standard_normal((len(rows), count)).astype(rows.dtype)
    draws = rows @ np.linalg.qr(rows.T @ draws)[0]
    basis = np.linalg.qr(rows.T @ draws)[0]  # (E, C)
    u, size, vt = np.linalg.svd(rows @ basis, full_matrices=False)
    return u * size, vt @ basis.T
