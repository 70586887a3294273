"""Wall time of repeated work."""

import time
from collections.abc import Callable

import numpy as np
from threadpoolctl import threadpool_limits

from odeform.types import Floats

__all__ = ["as_viewed", "milliseconds", "quantiles", "typical"]


def milliseconds(work: Callable[[int], object], repeats: int, warm: int = 3) -> Floats:
    """(R,) milliseconds that `work(index)` takes for each of R = `repeats` indices, after `warm` warm-up runs."""
    for index in range(warm):
        work(index)
    out = np.empty(repeats)
    for index in range(repeats):
        begin = time.perf_counter()
        work(index)
        out[index] = 1e3 * (time.perf_counter() - begin)
    return out


def quantiles(samples: Floats) -> dict[str, float]:
    """Returns the median `p50` and 95th percentile `p95` of samples (R,), in their unit."""
    return {"p50": float(np.percentile(samples, 50)), "p95": float(np.percentile(samples, 95))}


def typical(work: Callable[[int], object], repeats: int, warm: int = 3) -> float:
    """Returns the median of `milliseconds`."""
    return float(np.median(milliseconds(work, repeats, warm)))


def as_viewed() -> threadpool_limits:
    """Limit matrix products to one thread, as in the viewer. Threads that wait for each other would otherwise measure
    the load of other programs."""
    return threadpool_limits(1, "blas")
