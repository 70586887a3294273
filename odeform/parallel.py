"""Independent work in parallel, on joblib: processes by default, or any backend that the caller selects.

`with joblib.parallel_config(backend="dask")` around a call sends its work to a cluster.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from joblib import Parallel, cpu_count, delayed
from threadpoolctl import threadpool_limits

from odeform.progress import Progress

__all__ = ["as_completed", "parallel_map"]

Item = TypeVar("Item")
Result = TypeVar("Result")


def as_completed(
    function: Callable[[Item], Result], items: Sequence[Item], workers: int | None = None, batch_size: int = 1
) -> Iterator[tuple[int, Result]]:
    """Yield `(index, function(items[index]))` for every item, as soon as each is done.

    `workers` processes (default: one a core) run `function`, which must be importable, with one BLAS thread each:
    several on one core wait for each other. A worker takes `batch_size` items at a time. With one worker everything
    runs in this process, in order. What `function` raises is raised here.
    """
    batches = -(-len(items) // batch_size)
    if not batches:
        return
    options: Any = {"batch_size": batch_size}  # its stub declares the default's type, a string
    jobs: Any = Parallel(
        n_jobs=min(workers or cpu_count(), batches),
        return_as="generator_unordered",
        max_nbytes=None,  # larger arrays would arrive read-only
        **options,
    )
    # here for backends that run in this process, in `_numbered` for all others
    with threadpool_limits(1, "blas"):
        yield from jobs(delayed(_numbered)(function, index, item) for index, item in enumerate(items))


def parallel_map(
    title: str,
    function: Callable[[Item], Result],
    items: Sequence[Item],
    workers: int | None = None,
    batch_size: int = 1,
) -> list[Result]:
    """The results of `as_completed` in the order of `items`, with progress under `title`."""
    progress, results = Progress(title, len(items)), {}
    for index, result in as_completed(function, items, workers, batch_size):
        results[index] = result
        progress.advance()
    progress.close()
    return [results[index] for index in range(len(items))]


def _numbered(function: Callable[[Item], Result], index: int, item: Item) -> tuple[int, Result]:
    # a worker process keeps its limit: restored by one of several threads, it would end early for the others
    threadpool_limits(1, "blas")
    return index, function(item)
