"""One thread that serves the newest request. Callbacks only wake it, so nothing stale is ever shown."""

import sys
import threading
import traceback
from collections.abc import Callable

__all__ = ["Worker"]


class Worker:
    """Calls `serve` whenever woken, however often that was while it was busy: once, with the newest state.

    `serve` returns the seconds after which it wants to be called again, or None to sleep until woken.
    """

    def __init__(self, serve: Callable[[], float | None]) -> None:
        self._serve = serve
        self._awake = threading.Event()
        self._running = True
        self._thread = threading.Thread(target=self._loop, name="odeform-worker", daemon=True)

    def start(self) -> None:
        self._awake.set()
        self._thread.start()

    def wake(self) -> None:
        self._awake.set()

    @property
    def undisturbed(self) -> bool:
        """Whether nothing has been requested for since this round began."""
        return not self._awake.is_set()

    def stop(self) -> None:
        """Finish the round under way and end the thread."""
        self._running = False
        self._awake.set()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)

    def _loop(self) -> None:
        pause: float | None = None
        said = ""
        while True:
            self._awake.wait(pause)
            self._awake.clear()  # before reading the requests: one that comes later wakes the next round
            if not self._running:
                return
            try:
                pause = self._serve()
            except Exception:
                # must not end the session: the last good frame stays. Said once, not 30 times a second
                error = traceback.format_exc()
                if error != said:
                    print(error, file=sys.stderr)
                said, pause = error, None
