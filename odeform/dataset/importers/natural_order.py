"""Files in natural order: numbers in names count by their value."""

import re
from collections.abc import Iterable
from pathlib import Path

__all__ = ["naturally_sorted", "subfolders"]


def naturally_sorted(paths: Iterable[Path]) -> list[Path]:
    """Sorts by name, with frame_2 before frame_10. Hidden files are left out."""

    def key(path: Path) -> list[tuple[int, int, str]]:
        parts = re.split(r"(\d+)", path.name)
        return [(1, int(part), "") if part.isdecimal() else (0, 0, part) for part in parts]

    return sorted((path for path in paths if not path.name.startswith(".")), key=key)


def subfolders(root: Path) -> list[Path]:
    """The folders in `root` in natural order; empty if it does not exist."""
    return naturally_sorted(path for path in root.iterdir() if path.is_dir()) if root.is_dir() else []
