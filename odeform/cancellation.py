"""Cooperative cancellation: long computations check regularly whether their result is still needed."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["Cancelled", "cancel_unless", "check_cancelled"]


class Cancelled(Exception):
    """Raised in a computation whose result is no longer needed."""


_needed: ContextVar[Callable[[], bool]] = ContextVar("needed", default=lambda: True)


@contextmanager
def cancel_unless(needed: Callable[[], bool]) -> Iterator[None]:
    """Within the context, on this thread, computations raise `Cancelled` soon after `needed()` returns false."""
    token = _needed.set(needed)
    try:
        yield
    finally:
        _needed.reset(token)


def check_cancelled() -> None:
    """Raise `Cancelled` if the result is no longer needed. Long computations call this several times a second."""
    if not _needed.get()():
        raise Cancelled
