"""Keeps a motion out of the floor."""

from collections.abc import Callable
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.motion.trajectory import Moving
from odeform.types import Floats, Times

__all__ = ["FloorProjection", "raised"]

MOST = 0.01  # m; a motion that would have to be raised farther is lost, and is left to the plausibility check


class FloorProjection:
    """Raises a body where its motion takes it deeper into the floor than it may be: an `Adjustment`.

    Springs of the floor stand for the compression of what rests on it, so a leg under load sinks. Where that is more
    than the floor allows, the rest of the motion is nevertheless right: the body is raised by what is too much.
    """

    def __init__(
        self,
        inner: Moving,
        lowest: Callable[[Floats], Floats],
        limit: Callable[[Times], Times],
        grid: Float[np.ndarray, " grid"] | None = None,
    ) -> None:
        """`lowest` maps coordinates (R, 6 + K) of `inner` to the height of the lowest point (R,) in m, which may be
        `limit` (T,) m at (T,) s.

        With `grid`, in s, the change is linear between these times; after them, each moment has its own.
        """
        self._inner, self._lowest, self._limit, self._grid = inner, lowest, limit, grid

    def __call__(self, times: Times, y: Floats) -> Float[np.ndarray, "*batch times y"]:
        """Maps coordinates (T, 6 + K) of `inner` at (T,) s to (T, 6 + K); of many motions, (B, T, 6 + K)."""
        if self._grid is None or times.min() > self._grid[-1]:
            return raised(y, self._lowest, self._limit(times))
        return _moved_up(y, self._between(times, y, self._grid))

    def _between(self, times: Times, y: Floats, grid: Float[np.ndarray, " grid"]) -> Float[np.ndarray, "*batch times"]:
        """Interpolates the changes of each motion on the grid."""
        by = np.stack([np.interp(times, grid, each) for each in self._on_grid.reshape(-1, len(grid))])
        by = by.reshape(y.shape[:-1])
        if len(later := np.flatnonzero(times > grid[-1])):
            by[..., later] = self._missing(times[later], y[..., later, :])
        return by

    @cached_property
    def _on_grid(self) -> Floats:
        """(G,) m at the times of the grid, or (B, G)."""
        assert self._grid is not None
        return self._missing(self._grid, self._inner.reduced(self._grid))

    def _missing(self, times: Times, y: Floats) -> Floats:
        return _missing(y, self._lowest, self._limit(times))


def raised(y: Floats, lowest: Callable[[Floats], Floats], limit: float | Times) -> Float[np.ndarray, "*batch times y"]:
    """Returns coordinates (..., T, 6 + K), each moment raised by itself: its lowest point is not below `limit`, a
    number or (T,) in m. The others are as of `FloorProjection`."""
    return _moved_up(y, _missing(y, lowest, limit))


def _moved_up(y: Floats, by: Floats) -> Floats:
    if by.any():
        y = y.copy()
        y[..., 2] += by
    return y


def _missing(y: Floats, lowest: Callable[[Floats], Floats], limit: float | Times) -> Floats:
    """(..., T) m by which coordinates (..., T, 6 + K) are raised."""
    deeper = limit - lowest(y.reshape(-1, y.shape[-1])).reshape(y.shape[:-1])
    return np.where((deeper > 0.0) & (deeper <= MOST), deeper, 0.0)  # false for what is not finite
