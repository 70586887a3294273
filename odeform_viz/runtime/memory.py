"""Returns freed memory to the operating system. glibc needs to be asked; elsewhere these functions do nothing."""

import ctypes
import sys
import time

__all__ = ["MallocTrimmer", "share_arenas"]

M_ARENA_MAX = -8  # option of mallopt
INTERVAL = 2.0  # s


def share_arenas(count: int = 2) -> None:
    """Let threads started later share `count` malloc arenas; each of viser's many threads would keep its own."""
    if (libc := _glibc()) is not None:
        libc.mallopt(M_ARENA_MAX, count)


class MallocTrimmer:
    """Returns freed memory at most every two seconds; takes some milliseconds, without holding the GIL."""

    def __init__(self) -> None:
        self._libc = _glibc()
        self._last = 0.0

    def __call__(self) -> None:
        now = time.monotonic()
        if self._libc is not None and now - self._last > INTERVAL:
            self._last = now
            self._libc.malloc_trim(0)


def _glibc() -> ctypes.CDLL | None:
    if sys.platform != "linux":
        return None
    libc = ctypes.CDLL(None)
    return libc if hasattr(libc, "malloc_trim") else None
