"""Directions that are spread evenly."""

import numpy as np

from odeform.types import Vectors

__all__ = ["even_directions"]


def even_directions(count: int) -> Vectors:
    """Returns (count, 3) unit vectors, from up to down on a spiral (a Fibonacci lattice)."""
    index = np.arange(count) + 0.5
    height, turn = 1.0 - 2.0 * index / count, np.pi * (1.0 + 5.0**0.5) * index
    across = np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)
