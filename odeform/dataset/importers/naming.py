"""Files in the order that a person would give them."""

import re
from collections.abc import Iterable
from pathlib import Path

__all__ = ["in_order", "subfolders"]


def in_order(paths: Iterable[Path]) -> list[Path]:
    """By name, numbers by their value: frame_2 before frame_10. They need not start at 0. Hidden ones are left out."""

    def key(path: Path) -> list[tuple[int, int, str]]:
        parts = re.split(r"(\d+)", path.name)
        return [(1, int(part), "") if part.isdecimal() else (0, 0, part) for part in parts]

    return sorted((path for path in paths if not path.name.startswith(".")), key=key)


def subfolders(root: Path) -> list[Path]:
    return in_order(path for path in root.iterdir() if path.is_dir()) if root.is_dir() else []
