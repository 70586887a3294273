"""Code blocks of the README and the docs, with the marks that say how a test treats them.

A comment before a block sets its mark: `<!-- test: slow -->` and `<!-- test: run -->` (a bash block whose commands are
really run), or `<!-- test: skip, REASON -->`.
"""

import re
from dataclasses import dataclass
from pathlib import Path

__all__ = ["ROOT", "Block", "blocks_of", "pages", "prose"]

ROOT = Path(__file__).parents[2]
FENCE = re.compile(r"^(```+)(\w*)(?: title=\"([^\"]+)\")?\s*$")
MARK = re.compile(r"^<!-- test: ([^>]+?) -->$")


@dataclass(frozen=True)
class Block:
    """One fenced block; `line` is that of its fence, counted from 1."""

    page: Path
    line: int
    language: str
    title: str
    code: str
    mark: str

    @property
    def where(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def pages() -> list[Path]:
    """Every page that a user reads: at the top level, and in `docs`."""
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


def blocks_of(page: Path) -> list[Block]:
    """The blocks of a page, in order; `ValueError` for a block that is never closed."""
    lines, found, mark, index = page.read_text().splitlines(), [], "", 0
    while index < len(lines):
        if fence := FENCE.match(lines[index]):
            end = lines.index(fence[1], index + 1)
            code = "\n".join(lines[index + 1 : end])
            found.append(Block(page, index + 1, fence[2], fence[3] or "", code, mark))
            index = end
        if marked := MARK.match(lines[index]):
            mark = marked[1]
        elif lines[index].strip():
            mark = ""
        index += 1
    return found


def prose(page: Path) -> str:
    """The page without its blocks and inline code."""
    lines, fence = [], ""
    for line in page.read_text().splitlines():
        if match := re.match(r"^(```+)", line):
            fence = "" if line == fence else fence or match[1]
        elif not fence:
            lines.append(re.sub(r"`[^`]*`", "code", line))
    return "\n".join(lines)
