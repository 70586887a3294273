"""Whether an answer is still wanted: long work asks now and then, and gives up when nobody waits for it any more."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["Unwanted", "as_long_as", "check_wanted"]


class Unwanted(Exception):
    """The answer would come too late; nothing has changed."""


_wanted: ContextVar[Callable[[], bool]] = ContextVar("wanted", default=lambda: True)


@contextmanager
def as_long_as(wanted: Callable[[], bool]) -> Iterator[None]:
    """Long work within, on this thread, raises `Unwanted` soon after `wanted()` has become false."""
    token = _wanted.set(wanted)
    try:
        yield
    finally:
        _wanted.reset(token)


def check_wanted() -> None:
    """To be called by long work, several times a second."""
    if not _wanted.get()():
        raise Unwanted
