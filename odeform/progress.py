"""Progress of long work: a bar on a terminal, plain lines elsewhere."""

import sys
import time

__all__ = ["Progress"]


class Progress:
    """Counts finished units and prints rate and time left to standard error."""

    def __init__(self, title: str, total: int, done: int = 0) -> None:
        self._title, self._total, self._done, self._first = title, total, done, done
        self._start = time.monotonic()
        self._printed = 0.0
        self._terminal = sys.stderr.isatty()

    def advance(self, count: int = 1, note: str = "") -> None:
        """Count further units as finished; `note` is printed beside them."""
        self._done += count
        now = time.monotonic()
        every = 0.1 if self._terminal else 10.0
        if note or self._done == self._total or now - self._printed >= every:
            self._printed = now
            self._print(note, now - self._start)

    def _print(self, note: str, elapsed: float) -> None:
        rate = (self._done - self._first) / max(elapsed, 1e-9)
        left = (self._total - self._done) / max(rate, 1e-9)
        text = f"{self._title}: {self._done}/{self._total}, {rate:.2f}/s, {left:.0f} s left"
        if self._terminal:
            filled = 24 * self._done // max(self._total, 1)
            print(f"\r[{'#' * filled}{'.' * (24 - filled)}] {text} {note}\033[K", end="", file=sys.stderr, flush=True)
        else:
            print(f"{text} {note}".rstrip(), file=sys.stderr, flush=True)

    def close(self) -> None:
        """End the line of the bar."""
        if self._terminal:
            print(file=sys.stderr)
