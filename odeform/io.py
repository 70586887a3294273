"""Atomic writing of files, and the location of bundled ones."""

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

__all__ = ["atomic_open", "atomic_write", "bundled", "safetensors_metadata"]


@contextmanager
def atomic_open(path: Path) -> Iterator[IO[bytes]]:
    """Open a file for writing that replaces `path` only when the context ends without an error. Creates folders."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def atomic_write(path: Path, data: bytes) -> None:
    """Write `data` with `atomic_open`."""
    with atomic_open(path) as file:
        file.write(data)


def safetensors_metadata(data: bytes) -> dict[str, str]:
    """The metadata of a valid safetensors file in memory; the library reads them from paths only."""
    return json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")]).get("__metadata__", {})


def bundled(kind: str) -> Path:
    """The folder `assets/<kind>` of a clone or an installed wheel. It may not exist."""
    here = Path(__file__).resolve().parent
    installed = here / "assets" / kind
    return installed if installed.is_dir() else here.parent / "assets" / kind
