"""A thread that serves the newest request. Callbacks only wake it, so it never serves an outdated request."""

import sys
import threading
import traceback
from collections.abc import Callable

__all__ = ["Worker"]


class Worker:
    """Calls `serve` after `wake`; calls to `wake` while it is busy are merged into one.

    `serve` returns the seconds until it wants to be called again, or None to sleep until woken. An exception in it is
    printed once, and the thread goes on.
    """

    def __init__(self, serve: Callable[[], float | None]) -> None:
        self._serve = serve
        self._awake = threading.Event()
        self._running = True
        self._thread = threading.Thread(target=self._loop, name="odeform-worker", daemon=True)

    def start(self) -> None:
        """Start the thread, with a first call of `serve`."""
        self._awake.set()
        self._thread.start()

    def wake(self) -> None:
        """Ask for a call of `serve`, from any thread."""
        self._awake.set()

    @property
    def up_to_date(self) -> bool:
        """Whether `wake` has not been called since the current call of `serve` began."""
        return not self._awake.is_set()

    def stop(self) -> None:
        """Finish the current call of `serve` and end the thread; waits at most 5 s."""
        self._running = False
        self._awake.set()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)

    def _loop(self) -> None:
        pause: float | None = None
        printed = ""
        while True:
            self._awake.wait(pause)
            self._awake.clear()  # before reading the request: a later one wakes the next round
            if not self._running:
                return
            try:
                pause = self._serve()
            except Exception:
                if not self._running:  # a call that outlasted `stop`: what it serves may be closed
                    return
                # the session goes on with the last good frame; printed once, not 30 times a second
                error = traceback.format_exc()
                if error != printed:
                    print(error, file=sys.stderr)
                printed, pause = error, None
