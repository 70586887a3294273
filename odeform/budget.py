"""How much memory a file may take. What it claims to hold is checked before anything is allocated."""

from pathlib import Path

from odeform.errors import InputError

__all__ = ["MEMORY", "read_limited", "require_memory"]

MEMORY = 2 << 30  # bytes


def require_memory(where: str, what: str, size: int | float) -> None:
    """Raise `InputError` if reading `what`, in words, takes more than 2 GB of memory. `where` leads the message."""
    if size > MEMORY:
        raise InputError(f"{where}: {what} take about {size / 1e9:.3g} GB of memory to read; expected at most 2 GB")


def read_limited(path: Path, where: str, most: int) -> bytes:
    """The content of a file of at most `most` bytes. `InputError` for a longer one; devices and pipes count as read.

    Raises `OSError` as `open` does.
    """
    with path.open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise InputError(f"{where}: expected at most {most >> 20} MiB, got more")
    return data
