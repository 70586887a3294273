"""Returns freed memory to the operating system. glibc needs to be asked; elsewhere these functions do nothing."""

import ctypes
import sys
import threading

__all__ = ["MallocTrimmer", "share_arenas"]

M_ARENA_MAX = -8  # option of mallopt
DELAY = 2.0  # s


def share_arenas(count: int = 2) -> None:
    """Let threads started later share `count` malloc arenas; each of viser's many threads would keep its own."""
    if (libc := _glibc()) is not None:
        libc.mallopt(M_ARENA_MAX, count)


class MallocTrimmer:
    """Returns freed memory two seconds after it is asked to; requests in between count as one.

    What was asked for often frees more of its memory a moment later. Takes some milliseconds, without holding the GIL.
    """

    def __init__(self) -> None:
        self._libc = _glibc()
        self._lock = threading.Lock()
        self._timer: threading.Timer | None = None

    def __call__(self) -> None:
        with self._lock:
            if self._libc is None or self._timer is not None:
                return
            self._timer = threading.Timer(DELAY, self._trim)
            self._timer.daemon = True
            self._timer.start()

    def _trim(self) -> None:
        with self._lock:
            self._timer = None
        assert self._libc is not None
        self._libc.malloc_trim(0)


def _glibc() -> ctypes.CDLL | None:
    if sys.platform != "linux":
        return None
    libc = ctypes.CDLL(None)
    return libc if hasattr(libc, "malloc_trim") else None
