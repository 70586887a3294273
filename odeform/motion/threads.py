"""Threads that all motions share, for work that numpy does outside of the interpreter's lock."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from functools import cache
from typing import TypeVar

__all__ = ["thread_map"]

Item = TypeVar("Item")
Result = TypeVar("Result")


@cache
def _pool() -> ThreadPoolExecutor:
    # kept for good: the first product of a new thread takes longer than a frame
    return ThreadPoolExecutor(os.cpu_count(), "decode")


def thread_map(work: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Does `work` on each item, in order, one thread per core; each inherits the caller's cancellation."""
    items = list(items)
    contexts = [copy_context() for _ in items]
    return list(_pool().map(lambda context, item: context.run(work, item), contexts, items))
