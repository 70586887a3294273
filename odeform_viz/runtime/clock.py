"""The moment that is shown: played, paused, stepped."""

import threading
import time
from collections.abc import Callable

__all__ = ["Clock"]


class Clock:
    """Maps wall time to the motion's time. Plays from `start` to `stop`, where it loops or halts.

    `now` is a monotonic clock in seconds, given for tests.
    """

    def __init__(self, start: float, stop: float, now: Callable[[], float] = time.monotonic) -> None:
        self.start, self.stop = start, stop
        self._now = now
        self._lock = threading.Lock()
        self._anchor_wall, self._anchor = now(), start
        self._speed = 1.0
        self._playing = False
        self.loop = True

    @property
    def playing(self) -> bool:
        return self._playing

    def time(self) -> float:
        """The moment shown now, in seconds of the motion."""
        with self._lock:
            return self._time()

    def _time(self) -> float:
        if not self._playing:
            return self._anchor
        moment = self._anchor + self._speed * (self._now() - self._anchor_wall)
        # played from beyond the end, the motion runs on to wherever the user had gone
        end = max(self.stop, self._anchor)
        if moment < end:
            return moment
        if not self.loop:
            self._playing, self._anchor = False, end
            return end
        span = max(self.stop - self.start, 1e-9)
        self._set(self.start + (moment - end) % span)
        return self._anchor

    def _set(self, moment: float) -> None:
        self._anchor, self._anchor_wall = moment, self._now()

    def play(self) -> None:
        with self._lock:
            if not self._playing:
                self._set(self.start if self._anchor >= self.stop else self._anchor)
                self._playing = True

    def pause(self) -> None:
        with self._lock:
            self._anchor = self._time()
            self._playing = False

    def seek(self, moment: float) -> None:
        with self._lock:
            self._set(moment)

    def set_speed(self, speed: float) -> None:
        """Seconds of motion in a second of wall time."""
        with self._lock:
            self._set(self._time())
            self._speed = speed
