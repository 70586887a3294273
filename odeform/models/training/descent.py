"""Defines what all gradient descents use: the learning-rate schedule and the settings of the processor."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import torch
from threadpoolctl import threadpool_limits

__all__ = ["cosine_decay", "small_batches"]


def cosine_decay(fraction: float) -> float:
    """Factor of the learning rate at this fraction of the training: from 1 to 0 (Loshchilov & Hutter 2017)."""
    return 0.5 * (1.0 + math.cos(math.pi * fraction))


@contextmanager
def small_batches() -> Iterator[None]:
    """One thread of the processor, and no denormal numbers.

    Batches are small; with one thread the results do not depend on the number of cores, and the threads of a product
    do not wait for each other beside other programs. Denormal numbers slow training thirty-fold on some processors.
    Elsewhere they matter: SciPy's k-d tree recurses without end where they are flushed to 0.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    try:
        with threadpool_limits(1, "blas"):
            yield
    finally:
        torch.set_num_threads(threads)
        torch.set_flush_denormal(False)
