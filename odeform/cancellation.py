"""Whether an answer is still wanted: long work asks now and then, and gives up when nobody waits for it any more."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["Cancelled", "cancel_unless", "check_cancelled"]


class Cancelled(Exception):
    """The answer would come too late; nothing has changed."""


_wanted: ContextVar[Callable[[], bool]] = ContextVar("wanted", default=lambda: True)


@contextmanager
def cancel_unless(wanted: Callable[[], bool]) -> Iterator[None]:
    """Long work within, on this thread, raises `Cancelled` soon after `wanted()` has become false."""
    token = _wanted.set(wanted)
    try:
        yield
    finally:
        _wanted.reset(token)


def check_cancelled() -> None:
    """To be called by long work, several times a second."""
    if not _wanted.get()():
        raise Cancelled
