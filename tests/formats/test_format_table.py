"""The table of formats in the docs names every format, once, as the registry has it."""

import re
from pathlib import Path

from odeform.formats.foreign import UNREAD
from odeform.formats.registry import READERS

PAGE = (Path(__file__).parents[2] / "docs" / "file-formats.md").read_text()
SHAPES = re.search(r"## Shapes\n(.*?)\n## ", PAGE, re.DOTALL)


def _suffixes(title: str) -> list[list[str]]:
    """The suffixes in the first column of each row of the table with this second column."""
    assert SHAPES is not None
    table = SHAPES[1].partition(f"| format | {title} ")[2].partition("\n\n")[0]
    return [re.findall(r"`(\.[a-z0-9]+)`", row.split("|")[1]) for row in table.splitlines() if row.startswith("| `")]


def test_every_format_that_is_read_has_one_row() -> None:
    assert sorted(suffix for row in _suffixes("read") for suffix in row) == sorted(READERS)


def test_every_format_that_is_not_read_has_one_row_with_what_to_convert_it_to() -> None:
    assert sorted(suffix for row in _suffixes("convert to") for suffix in row) == sorted(UNREAD)
    assert SHAPES is not None
    for target in set(UNREAD.values()):
        assert " or ".join(f"`{name}`" for name in re.split(r", | or ", target)) in SHAPES[1]
