"""How a text of points is laid out: separators, decimal sign, a count, names of columns."""

import re
from dataclasses import dataclass

import numpy as np

from odeform.errors import InputError
from odeform.types import Ints

__all__ = ["Layout", "find_layout"]

COMMENTS = (b"#", b"//", b"%", b"!")
MOST_HEADER = 100  # lines that are looked at
NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)
COMMA_NUMBER = re.compile(rb"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)
NAMES = {
    **{
        f"{prefix}{axis}": axis
        for axis in "xyz"
        for prefix in ("", "p", "pos", "pos_", "point_", "position_", "coord_")
    },
    **{f"points:{index}": axis for index, axis in enumerate("xyz")},
    **{f"points_{index}": axis for index, axis in enumerate("xyz")},
    **{"easting": "x", "northing": "y", "elevation": "z", "height": "z", "altitude": "z"},
    **{"r": "red", "g": "green", "b": "blue", "red": "red", "green": "green", "blue": "blue"},
}


@dataclass(frozen=True)
class Layout:
    """The layout of a text of points.

    Attributes:
        header: How many lines come before the points.
        separator: What stands between columns: a space, a comma or a semicolon.
        comma: Whether numbers have a decimal comma.
        count: How many points the file says that it has.
        names: Of the columns, x, y and z among them; empty where they are not named.
    """

    header: int = 0
    separator: bytes = b" "
    comma: bool = False
    count: int | None = None
    names: tuple[str, ...] = ()

    def rows(self, text: bytes) -> tuple[bytes, Ints]:
        """Returns the lines of N points, with spaces between their numbers, and the number (N,) of each line."""
        kept, numbers = [], []
        for number, line in enumerate(text.split(b"\n"), 1):
            line = line.strip()
            if number > self.header and line.strip(b' ,;"') and not line.startswith(COMMENTS):
                kept.append(self.spaced(line))
                numbers.append(number)
        return b"\n".join(kept) + b"\n", np.array(numbers, np.int64)

    def spaced(self, line: bytes) -> bytes:
        """A line with spaces between its words, and decimal points. An empty cell counts as not a number."""
        line = line.replace(b'"', b"").partition(b" #")[0]
        if self.comma:
            line = line.replace(b", ", b" ").rstrip(b",").replace(b",", b".")
        if self.separator == b" ":
            return line
        words = [word.strip() or b"nan" for word in line.rstrip(b" " + self.separator).split(self.separator)]
        return b" ".join(words)


def find_layout(text: bytes, where: str) -> Layout:
    """Finds the layout of a text. Raises `InputError` without any line of numbers, and for columns without x, y and
    z."""
    names: tuple[bytes, tuple[bytes, ...]] | None = None
    count, odd, at = None, b"", 0
    for index, raw in enumerate(text.split(b"\n", MOST_HEADER)[:MOST_HEADER]):
        line = raw.strip()
        bare = line.lstrip(b"#/%! ")
        if not line or line.lower().startswith(b"sep="):
            continue
        separator, comma = _separator(bare)
        words = _words(bare, separator)
        numeric = bool(words) and all((COMMA_NUMBER if comma else NUMBER).fullmatch(word) for word in words if word)
        if line.startswith(COMMENTS) or not numeric:
            if {b"x", b"y", b"z"} <= {_name(word).encode() for word in words}:
                names = separator, tuple(words)
            elif not line.startswith(COMMENTS):
                odd, at = (odd, at) if odd else (line, index + 1)
                if names and any(character in b"0123456789" for character in line):
                    break
            continue
        if len(words) == 1 and count is None and words[0].isdigit() and len(words[0]) < 13:
            count = int(words[0])
            continue
        if odd and names is None and count is None:
            break
        found = tuple(_name(word) for word in names[1]) if names else ()
        comma = comma or (separator == b" " and _decimal_commas(text))
        return Layout(
            index, separator, comma, count, found if len(found) == len(words) else _first(found, words, where)
        )
    shown = (odd or text.strip()[:1])[:40].decode("utf-8", "replace")
    line = f"line {at}: " if at else ""
    raise InputError(
        f"{where}: {line}expected lines of numbers x y z, got {shown!r}" if shown else f"{where}: an empty file"
    )


def _first(names: tuple[str, ...], words: list[bytes], where: str) -> tuple[str, ...]:
    if names and len(names) != len(words):
        raise InputError(f"{where}: expected {len(names)} numbers in each line, as named, got {len(words)}")
    return names


def _separator(line: bytes) -> tuple[bytes, bool]:
    """Finds what separates the columns of a line, and whether its numbers have decimal commas."""
    if b";" in line:
        return b";", b"." not in line
    words = _words(line, b" ")
    if len(words) >= 2 and all(map(COMMA_NUMBER.fullmatch, words)) and any(b"," in word for word in words):
        return b" ", True
    return (b",", False) if b"," in line else (b" ", False)


def _decimal_commas(text: bytes) -> bool:
    """Whether the first line of numbers with a comma has it as a decimal sign. Those before may be whole numbers."""
    with_comma = re.search(rb"(?m)^[ \d+.eE-]*,[ \d+,.eE-]*$", text)
    return bool(with_comma) and _separator(with_comma[0].strip())[1]


def _words(line: bytes, separator: bytes) -> list[bytes]:
    line = line.replace(b'"', b"")
    if separator == b" ":
        return [word.rstrip(b",") for word in line.split()]
    return [word.strip() for word in line.rstrip(b" " + separator).split(separator)]


def _name(word: bytes) -> str:
    """The axis or color that a column is named after, else its name."""
    name = re.sub(r"[\[(].*", "", word.decode("utf-8", "replace")).strip().lower()
    return NAMES.get(name, name)
