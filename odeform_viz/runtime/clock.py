"""Playback time: play, pause, seek, speed, loop."""

import threading
import time
from collections.abc import Callable

__all__ = ["Clock"]


class Clock:
    """Maps wall-clock time to the time of a motion, in seconds. Plays from `start` to `stop`, then loops or stops.

    `now` is a monotonic clock in seconds; tests pass their own. All methods are thread-safe.
    """

    def __init__(self, start: float, stop: float, now: Callable[[], float] = time.monotonic) -> None:
        self.start, self.stop = start, stop
        self._now = now
        self._lock = threading.Lock()
        self._anchor_wall, self._anchor = now(), start
        self._speed = 1.0
        self._playing = False
        self._slow: tuple[float, float, float] | None = None  # from, to, and the speed in between
        self.loop = True

    @property
    def playing(self) -> bool:
        """Whether the time advances."""
        return self._playing

    @property
    def speed(self) -> float:
        """Seconds of the motion in a second, where it is not slowed down."""
        return self._speed

    def time(self) -> float:
        """Returns the current time of the motion, in s."""
        with self._lock:
            return self._time()

    def _time(self) -> float:
        if not self._playing:
            return self._anchor
        current = self._advanced(self._now() - self._anchor_wall)
        # a user may seek beyond `stop`; playback then ends where they went
        end = max(self.stop, self._anchor)
        if current < end:
            return current
        if not self.loop:
            self._playing, self._anchor, self._slow = False, end, None
            return end
        self._slow = None
        span = max(self.stop - self.start, 1e-9)
        self._set(self.start + (current - end) % span)
        return self._anchor

    def _advanced(self, elapsed: float) -> float:
        """The time of the motion `elapsed` seconds after the anchor, were there no end."""
        if self._slow is None or self._anchor >= self._slow[1]:
            return self._anchor + self._speed * elapsed
        start, stop, speed = self._slow
        start = max(start, self._anchor)
        lead, through = (start - self._anchor) / self._speed, (stop - start) / speed
        if elapsed < lead:
            return self._anchor + self._speed * elapsed
        if elapsed < lead + through:
            return start + speed * (elapsed - lead)
        return stop + self._speed * (elapsed - lead - through)

    def slow_down_once(self, start: float, stop: float, seconds: float) -> None:
        """Take `seconds` from `start` to `stop`, in s of the motion, the next time they are played.

        Anything that the user does with the clock ends this.
        """
        with self._lock:
            self._set(self._time())
            self._slow = (start, stop, min((stop - start) / seconds, self._speed)) if stop > start else None

    def _set(self, current: float) -> None:
        self._anchor, self._anchor_wall = current, self._now()

    def play(self) -> None:
        """Start playing, from `start` if at or beyond `stop`."""
        with self._lock:
            if not self._playing:
                self._set(self.start if self._anchor >= self.stop else self._anchor)
                self._playing = True

    def pause(self) -> None:
        """Stop at the current time."""
        with self._lock:
            self._anchor = self._time()
            self._playing, self._slow = False, None

    def seek(self, time: float) -> None:
        """Jump to `time` in s, which may lie beyond `stop`; playback goes on if it was playing."""
        with self._lock:
            self._set(time)
            self._slow = None

    def set_speed(self, speed: float) -> None:
        """Set the seconds of motion per second of wall-clock time, without a jump."""
        with self._lock:
            self._set(self._time())
            self._speed, self._slow = speed, None
