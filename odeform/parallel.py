"""Long work on many items, shared among the cores."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from typing import TypeVar

from threadpoolctl import threadpool_limits

from odeform.progress import Progress

__all__ = ["parallel_map"]

Item = TypeVar("Item")
Done = TypeVar("Done")


def parallel_map(
    title: str, work: Callable[[Sequence[Item]], list[Done]], items: Sequence[Item], together: int
) -> list[Done]:
    """What `work` makes of all items, in their order, in a process for each core; so many `together`.

    A product has one thread there: two on one core wait for each other.
    """
    parts = [items[at : at + together] for at in range(0, len(items), together)]
    progress, done = Progress(title, len(items)), []
    with ProcessPoolExecutor(min(os.cpu_count() or 1, len(parts)), mp_context=get_context("spawn")) as pool:
        for some in pool.map(partial(_alone, work), parts):
            done += some
            progress.advance(len(some))
    progress.close()
    return done


def _alone(work: Callable[[Sequence[Item]], list[Done]], items: Sequence[Item]) -> list[Done]:
    with threadpool_limits(1, "blas"):
        return work(items)
