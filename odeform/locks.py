"""A lock for objects that threads share and that are pickled."""

from threading import RLock

__all__ = ["Lock"]


class Lock:
    """Lets one thread at a time in, `with lock:`, also repeatedly. A pickled lock is read as an open one."""

    def __init__(self) -> None:
        self._lock = RLock()

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    def __reduce__(self) -> tuple[type["Lock"], tuple[()]]:
        return Lock, ()
