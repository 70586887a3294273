"""Takes what Rerun writes to a file through a pipe: its own writer hangs for good when the disk is full."""

import os
import select
import threading
import time

import rerun as rr

__all__ = ["Drain"]

SIZE = 1 << 18  # bytes that are read at a time
TIMEOUT = 10.0  # s


class Drain:
    """Collects the bytes of a stream in memory until they are taken. Rerun never waits for a disk."""

    def __init__(self, stream: rr.RecordingStream) -> None:
        self._stream = stream
        self._end, start = os.pipe()
        stream.save(f"/dev/fd/{start}")  # opened once more; the stream closes that when it is disconnected
        os.close(start)
        self._parts: list[bytes] = []
        self._lock = threading.Lock()
        self._arrived, self._more = _poll(self._end), _poll(self._end)  # one for each thread
        self._open = True
        self._thread = threading.Thread(target=self._collect, name="odeform-recording", daemon=True)
        self._thread.start()

    def _collect(self) -> None:
        data = b" "
        while data:
            self._arrived.poll()
            with self._lock:
                data = os.read(self._end, SIZE)
                self._parts.append(data)

    def take(self) -> bytes:
        """All complete messages since the last call. `RuntimeError` if Rerun does not deliver them in time."""
        self._stream.flush(timeout_sec=TIMEOUT)
        while True:
            with self._lock:
                if not self._more.poll(0):
                    return self._taken()
            time.sleep(0.0)  # the collecting thread has the rest

    def close(self) -> bytes:
        """End the stream, unless that is done; returns the bytes since the last call of `take`."""
        if self._open:
            self._open = False
            self._stream.disconnect()
            self._thread.join(TIMEOUT)
            os.close(self._end)
        return self._taken()

    def _taken(self) -> bytes:
        parts, self._parts = self._parts, []
        return b"".join(parts)


def _poll(end: int) -> select.poll:
    poll = select.poll()
    poll.register(end, select.POLLIN)
    return poll
