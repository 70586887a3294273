"""How high a body with corners stands: a mesh of a ball rolls from facet to facet."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.types import Floats, Ints, Points, Vector

__all__ = ["Support", "support_of"]

ANGLES = 4096
ROUNDED = 2e-3  # of the radius: the elastic wall rounds the corners
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Support:
    """By how much a body that has turned about an axis stands higher than at rest, and the derivative by the angle."""

    heights: Float[np.ndarray, " angles"]
    """m at even angles from 0 to 2 pi, both included."""
    slopes: Float[np.ndarray, " angles"]
    """m per rad."""

    def at(self, angles: Floats) -> tuple[Floats, Floats]:
        """Returns heights and slopes (...) at angles (...) in rad, of any size."""
        index, part = self._place(angles)
        return tuple(  # pyright: ignore
            table[index] + part * (table[index + 1] - table[index]) for table in (self.heights, self.slopes)
        )

    def bends(self, angles: Floats) -> Floats:
        """Computes (...) derivatives of the slopes at angles (...) in rad, m per rad^2."""
        index, _ = self._place(angles)
        return (self.slopes[index + 1] - self.slopes[index]) * (len(self.slopes) - 1) / (2.0 * np.pi)

    def _place(self, angles: Floats) -> tuple[Ints, Floats]:
        """Finds angles (...) in the tables: the entry before, and how far on towards the next one."""
        place = np.mod(angles / (2.0 * np.pi), 1.0) * (len(self.heights) - 1)
        index = np.minimum(place.astype(int), len(self.heights) - 2)
        return index, place - index


def support_of(points: Points, axis: Vector) -> Support:
    """Makes the support of a body's points (N, 3) in m about its anchor, which turns about the level unit vector
    `axis`."""
    angles = np.linspace(0.0, 2.0 * np.pi, ANGLES + 1)
    ahead = points @ np.cross(axis, UP)
    # a positive angle turns the direction ahead downwards
    depths = np.outer(np.sin(angles), ahead) - np.outer(np.cos(angles), points @ UP)
    deepest, rounded = depths.max(axis=1), ROUNDED * np.linalg.norm(points, axis=1).mean()
    weights = np.exp((depths - deepest[:, None]) / rounded)
    heights = deepest + rounded * np.log(weights.sum(axis=1))
    turned = np.outer(np.cos(angles), ahead) + np.outer(np.sin(angles), points @ UP)
    slopes = (weights * turned).sum(axis=1) / weights.sum(axis=1)
    return Support(heights - heights[0], slopes)
