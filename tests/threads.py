"""Many threads that ask at once."""

import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from typing import TypeVar

__all__ = ["THREADS", "all_at_once"]

THREADS = 8
Item = TypeVar("Item")
Result = TypeVar("Result")


def all_at_once(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """`work` on each item in a thread of its own; all begin together, and take turns as often as they can."""
    barrier, interval = Barrier(len(items)), sys.getswitchinterval()

    def started(item: Item) -> Result:
        barrier.wait()
        return work(item)

    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(len(items)) as pool:
            return list(pool.map(started, items))
    finally:
        sys.setswitchinterval(interval)
