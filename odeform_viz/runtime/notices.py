"""Messages that no frame may wipe out: what a click could not do, and why."""

import threading
import time

import viser

__all__ = ["Notices"]

SHOWN = 10.0  # s
AGAIN = 2.0  # s within which the same words are not said twice


class Notices:
    """Says a message to everybody who looks."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._lock = threading.Lock()
        self._last = ("", -AGAIN)

    def say(self, message: str) -> None:
        with self._lock:
            now = time.monotonic()
            if message == self._last[0] and now - self._last[1] < AGAIN:
                return
            self._last = (message, now)
        for client in self._server.get_clients().values():
            client.add_notification("That did not work", message, auto_close_seconds=SHOWN, color="orange")
