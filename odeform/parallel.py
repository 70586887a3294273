"""Independent work in parallel: in processes of this machine, by joblib, or in another engine.

`odeform.cluster` is an engine that sends the work to several machines.
"""

import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Any, TypeVar

from joblib import Parallel, cpu_count, delayed
from threadpoolctl import threadpool_limits

from odeform.progress import Progress

__all__ = ["Engine", "as_completed", "parallel_map", "use_engine", "workers_lost"]

POLL = 1.0  # s

Item = TypeVar("Item")
Result = TypeVar("Result")

Engine = Callable[[Callable[[Any], Any], Sequence[Any], int], Iterator[tuple[int, Any]]]
"""(function, items, batch size) -> what `as_completed` yields."""

_engine: ContextVar[Engine | None] = ContextVar("odeform_engine", default=None)


@contextmanager
def use_engine(engine: Engine) -> Iterator[None]:
    """Meanwhile `engine` does all parallel work of this context, whatever number of workers is asked for."""
    token = _engine.set(engine)
    try:
        yield
    finally:
        _engine.reset(token)


def workers_lost(error: BaseException) -> ChildProcessError:
    """The error of work that cannot be completed, because of `error`."""
    reason = f"{type(error).__name__}: {error}"
    return ChildProcessError(f"a worker or the connection to it was lost; finished work is kept ({reason})")


def as_completed(
    function: Callable[[Item], Result], items: Sequence[Item], workers: int | None = None, batch_size: int = 1
) -> Iterator[tuple[int, Result]]:
    """Yield `(index, function(items[index]))` for every item, as soon as each is done.

    `workers` processes (default: one a core) run `function`, which must be importable, with one BLAS thread each:
    several on one core wait for each other. A worker takes `batch_size` items at a time. With one worker everything
    runs in this process, in order. What `function` raises is raised here. Another backend of joblib may be chosen if
    its workers are threads or children of this process.

    Raises:
        ChildProcessError: A worker process ended, or several in turn on the same item of a cluster.
    """
    batches = -(-len(items) // batch_size)
    if not batches:
        return
    if engine := _engine.get():
        yield from engine(function, items, batch_size)
        return
    options: Any = {"batch_size": batch_size}  # its stub declares the default's type, a string
    jobs: Any = Parallel(
        n_jobs=min(workers or cpu_count(), batches),
        return_as="generator_unordered",
        max_nbytes=None,  # larger arrays would arrive read-only
        **options,
    )
    # here for backends that run in this process, in `_numbered` for all others
    parent = os.getpid()
    try:
        with threadpool_limits(1, "blas"):
            yield from jobs(delayed(_numbered)(function, index, item, parent) for index, item in enumerate(items))
    except BrokenExecutor as error:
        raise workers_lost(error) from None


def parallel_map(
    title: str,
    function: Callable[[Item], Result],
    items: Sequence[Item],
    workers: int | None = None,
    batch_size: int = 1,
) -> list[Result]:
    """Returns the results of `as_completed` in the order of `items`, with progress under `title`."""
    progress, results = Progress(title, len(items)), {}
    for index, result in as_completed(function, items, workers, batch_size):
        results[index] = result
        progress.advance()
    progress.close()
    return [results[index] for index in range(len(items))]


def _numbered(function: Callable[[Item], Result], index: int, item: Item, parent: int) -> tuple[int, Result]:
    if os.getpid() != parent:
        _end_with_parent(parent)
    # a worker process keeps its limit: restored by one of several threads, it would end early for the others
    threadpool_limits(1, "blas")
    return index, function(item)


@cache
def _end_with_parent(parent: int) -> None:
    """End this worker soon after the process that started it is gone, killed for instance, perhaps already."""

    def poll() -> None:
        while os.getppid() == parent:
            time.sleep(POLL)
        os._exit(1)

    threading.Thread(target=poll, name="odeform-parent", daemon=True).start()
