"""Memory that was freed goes back to the system. Only glibc needs to be told; elsewhere nothing happens."""

import ctypes
import sys
import time

__all__ = ["MallocTrimmer", "share_arenas"]

ARENA_MAX = -8  # glibc's name for the option
SELDOM = 2.0  # s


def share_arenas(count: int = 2) -> None:
    """Let threads that come share `count` heaps: each of the dozens that call back would keep one of its own."""
    if (libc := _glibc()) is not None:
        libc.mallopt(ARENA_MAX, count)


class MallocTrimmer:
    """Gives freed memory back, at most every two seconds; takes some milliseconds, outside of Python's lock."""

    def __init__(self) -> None:
        self._libc = _glibc()
        self._last = 0.0

    def __call__(self) -> None:
        now = time.monotonic()
        if self._libc is not None and now - self._last > SELDOM:
            self._last = now
            self._libc.malloc_trim(0)


def _glibc() -> ctypes.CDLL | None:
    if sys.platform != "linux":
        return None
    libc = ctypes.CDLL(None)
    return libc if hasattr(libc, "malloc_trim") else None
