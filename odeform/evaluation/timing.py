"""Wall time of repeated work."""

import time
from collections.abc import Callable

import numpy as np

from odeform.types import Floats

__all__ = ["milliseconds", "quantiles", "typical"]


def milliseconds(work: Callable[[int], object], repeats: int, warm: int = 3) -> Floats:
    """(repeats,) ms that `work(index)` takes, after `warm` runs that do not count."""
    for index in range(warm):
        work(index)
    out = np.empty(repeats)
    for index in range(repeats):
        begin = time.perf_counter()
        work(index)
        out[index] = 1e3 * (time.perf_counter() - begin)
    return out


def quantiles(samples: Floats) -> dict[str, float]:
    return {"p50": float(np.percentile(samples, 50)), "p95": float(np.percentile(samples, 95))}


def typical(work: Callable[[int], object], repeats: int, warm: int = 3) -> float:
    """The median of `milliseconds`."""
    return float(np.median(milliseconds(work, repeats, warm)))
