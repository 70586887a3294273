"""Defines what a kind of motion is made of."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from odeform.types import Faces, Floats, Frames

__all__ = ["Kind", "smoothstep"]


@dataclass(frozen=True)
class Kind:
    """Motions over a few parameters, in metres and seconds, z up; all start from the same shape."""

    description: str
    units: dict[str, str]
    """Unit of each parameter by name."""
    ranges: dict[str, tuple[float, float]]
    sequences: int
    rate: float
    """Frames per second."""
    frames: int
    move: Callable[[dict[str, float], Floats], tuple[Frames, Faces]]
    """(parameters, times (T,) s) -> vertices (T, N, 3) m and faces (F, 3)."""

    @property
    def times(self) -> Floats:
        """(T,) seconds."""
        return np.arange(self.frames) / self.rate

    def draws(self, seed: int) -> list[dict[str, float]]:
        """Draws the parameters of all sequences, evenly spread over their ranges (scrambled Sobol points)."""
        low, high = np.array(list(self.ranges.values())).T
        points = qmc.Sobol(len(low), rng=seed).random_base2(max(self.sequences - 1, 1).bit_length())
        scaled = qmc.scale(points[: self.sequences], low, high)
        return [dict(zip(self.ranges, map(float, row), strict=True)) for row in scaled]


def smoothstep(values: Floats, start: float, stop: float) -> Floats:
    """Rises from 0 at `start` to 1 at `stop`, with continuous slopes; values have any shape (...)."""
    fraction = np.clip((values - start) / (stop - start), 0.0, 1.0)
    return fraction**2 * (3.0 - 2.0 * fraction)
