"""Results of studies as JSON."""

import json
from pathlib import Path
from typing import Any

from odeform.io import atomic_write

__all__ = ["write_or_print"]


def write_or_print(result: Any, path: str | Path | None) -> None:
    """Writes a result of a study as JSON: in the file `path`, or on the terminal without one."""
    text = json.dumps(result, indent=1)
    if path:
        atomic_write(Path(path), text.encode())
    else:
        print(text)
