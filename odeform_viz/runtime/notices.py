"""Notifications in the page: what a click could not do, and why. New frames do not remove them."""

import threading
import time

import viser

__all__ = ["Notices"]

VISIBLE = 10.0  # s
REPEAT = 2.0  # s within which the same message is not shown again


class Notices:
    """Shows messages to all clients."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._lock = threading.Lock()
        self._last = ("", -REPEAT)

    def show(self, title: str, message: str) -> None:
        """Show for ten seconds what failed, and why."""
        with self._lock:
            now = time.monotonic()
            if message == self._last[0] and now - self._last[1] < REPEAT:
                return
            self._last = (message, now)
        for client in self._server.get_clients().values():
            client.add_notification(title, message, auto_close_seconds=VISIBLE, color="orange")
