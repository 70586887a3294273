"""Intervals of pooled errors: motions are drawn anew, with replacement (Efron 1979): few make most of it."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

__all__ = ["CONFIDENCE", "mean_interval", "pooled_draws", "pooled_interval"]

CONFIDENCE = 0.95
DRAWS, SEED = 4000, 0
FEWEST = 2  # motions, of fewer there is no interval

Motions = tuple[Float[np.ndarray, " _motions"], Float[np.ndarray, " _motions"]]  # groups differ in number
"""The sum of squares in mm^2 over the frames of each motion, and the number of its frames."""


def pooled_draws(motions: Motions, seed: int = SEED) -> Float[np.ndarray, " draws"]:
    """Computes (D,) pooled RMSE in mm of as many motions, drawn anew with replacement."""
    sums, counts = motions
    rng = np.random.default_rng(seed)
    # how often each motion was drawn
    times = rng.multinomial(len(sums), np.full(len(sums), 1.0 / len(sums)), size=DRAWS)
    return np.sqrt((times @ sums) / (times @ counts))


def pooled_interval(motions: Motions) -> tuple[float, float] | None:
    """The interval of a pooled RMSE in mm (percentiles); None for a single motion."""
    return None if len(motions[0]) < FEWEST else _ends(pooled_draws(motions))


def mean_interval(groups: Sequence[Motions]) -> tuple[float, float] | None:
    """The interval of the mean of the pooled RMSE of several groups, each drawn anew by itself."""
    if any(len(sums) < FEWEST for sums, _ in groups):
        return None
    return _ends(np.mean([pooled_draws(group, SEED + index) for index, group in enumerate(groups)], axis=0))


def _ends(draws: Float[np.ndarray, " draws"]) -> tuple[float, float]:
    low, high = np.quantile(draws, [0.5 - CONFIDENCE / 2.0, 0.5 + CONFIDENCE / 2.0])
    return float(low), float(high)
