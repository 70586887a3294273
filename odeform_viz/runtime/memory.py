"""Returns unused memory to the operating system."""

import ctypes
import gc
import sys
import threading

__all__ = ["Tidier", "share_arenas"]

M_MMAP_THRESHOLD, M_ARENA_MAX = -3, -8  # options of mallopt
LARGE = 1 << 20  # bytes
DELAY = 2.0  # s


def share_arenas(count: int = 2) -> None:
    """Let threads started later share `count` malloc arenas (glibc): each of viser's many would keep its own.

    Arrays from a megabyte on stay out of them. By default that limit grows to 32 MB as such arrays are freed, and small
    blocks that last then keep the space around them.
    """
    if (libc := _glibc()) is not None:
        libc.mallopt(M_ARENA_MAX, count)
        libc.mallopt(M_MMAP_THRESHOLD, LARGE)


class Tidier:
    """Collects garbage and returns freed memory two seconds after it is asked to; requests in between count as one.

    What was asked for often frees more of its memory a moment later. glibc keeps freed memory until it is asked for it.
    """

    def __init__(self) -> None:
        self._libc = _glibc()
        self._lock = threading.Lock()
        self._timer: threading.Timer | None = None
        gc.collect()
        gc.freeze()  # what is loaded by now stays: collecting then takes a tenth of the time

    def __call__(self) -> None:
        with self._lock:
            if self._timer is not None:
                return
            self._timer = threading.Timer(DELAY, self._tidy)
            self._timer.daemon = True
            self._timer.start()

    def _tidy(self) -> None:
        with self._lock:
            self._timer = None
        gc.collect()  # motions and their curves refer to each other
        if self._libc is not None:
            self._libc.malloc_trim(0)


def _glibc() -> ctypes.CDLL | None:
    if sys.platform != "linux":
        return None
    libc = ctypes.CDLL(None)
    return libc if hasattr(libc, "malloc_trim") else None
