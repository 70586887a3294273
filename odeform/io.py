"""Atomic writing of files, and the location of bundled ones."""

import errno
import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from odeform.errors import InputError

__all__ = [
    "atomic_open",
    "atomic_write",
    "bundled",
    "parse_json",
    "require_writable",
    "safetensors_metadata",
]

LONGEST = 100  # characters of a name in that of its temporary file
DIGITS = 300  # of an integer in JSON


@contextmanager
def atomic_open(path: Path) -> Iterator[IO[bytes]]:
    """Open a file for writing that replaces `path` only when the context ends without an error. Creates folders."""
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name[:LONGEST]}.")
    except OSError as error:  # names the temporary file
        raise OSError(error.errno, error.strerror, str(path)) from None
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException as error:
        Path(name).unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename is None:  # a full disk
            raise OSError(error.errno, error.strerror, str(path)) from None
        raise


def require_writable(path: Path) -> None:
    """Raise `InputError` if no file can be written at `path`, before the work for it begins. Writes nothing there."""
    folder = path.parent
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, "is a folder")
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None


def atomic_write(path: Path, data: bytes) -> None:
    """Write `data` with `atomic_open`."""
    with atomic_open(path) as file:
        file.write(data)


def parse_json(data: str | bytes, where: str) -> Any:
    """The value of a JSON text. Raises `InputError`, which `where` leads, for text that is not JSON or not plausible.

    Integers have at most 300 digits, so that each is a float too; arrays and objects are nested to a depth of hundreds.
    """
    try:
        return json.loads(data, parse_int=_integer)
    except RecursionError:
        raise InputError(f"{where}: not valid JSON: nested too deeply") from None
    except ValueError as error:
        raise InputError(f"{where}: not valid JSON: {error}") from None


def _integer(digits: str) -> int:
    if len(digits) > DIGITS:
        raise ValueError(f"a number of {len(digits)} digits")
    return int(digits)


def safetensors_metadata(data: bytes) -> dict[str, str]:
    """The metadata of a valid safetensors file in memory; the library reads them from paths only."""
    return json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")]).get("__metadata__", {})


def bundled(kind: str) -> Path:
    """The folder `assets/<kind>` of a clone or an installed wheel. It may not exist."""
    here = Path(__file__).resolve().parent
    installed = here / "assets" / kind
    return installed if installed.is_dir() else here.parent / "assets" / kind
