"""Returns unused memory to the operating system."""

import ctypes
import gc
import sys
import threading

import pyarrow as pa

__all__ = ["Tidier", "share_memory"]

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8  # options of mallopt
HUGE = 4 << 20  # bytes; numpy asks for huge pages for arrays from here on
KEPT = 64 << 20  # bytes that are free at the end of an arena, as much as glibc comes to keep by itself
DELAY = 2.0  # s


def share_memory(count: int = 2) -> None:
    """Let threads started later share `count` malloc arenas (glibc): each of viser's many would keep its own. Arrow,
    with which recordings are read and written, takes its memory there as well, in place of a pool that grows for hours.

    Arrays that numpy wants huge pages for stay out of the arenas, where pieces between them would then take whole huge
    pages. By default the limit grows to 32 MB as such arrays are freed. A lower one, or keeping less, costs time: with
    1 MB and 128 kB, scrubbing 100,000 splats takes twice as long, for the pages that the system has to clear.
    """
    pa.set_memory_pool(pa.system_memory_pool())
    if (libc := _glibc()) is not None:
        libc.mallopt(M_ARENA_MAX, count)
        libc.mallopt(M_MMAP_THRESHOLD, HUGE)
        libc.mallopt(M_TRIM_THRESHOLD, KEPT)


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
