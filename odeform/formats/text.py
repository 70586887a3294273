"""Text files as bytes without the habits of programs, and their numbers, with the line of whatever is none."""

import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.budget import MEMORY, read_limited
from odeform.errors import InputError
from odeform.formats.encodings import bare_utf16
from odeform.types import Ints

__all__ = ["Lines", "numbers_of", "plain_text", "read_text", "require_words", "words_per_line"]


SPACE, NEWLINE = 32, 10
DEEPEST = 16  # spaces before a word


def read_text(path: Path) -> bytes:
    """The text of a file as `plain_text` gives it. Raises `InputError` for more than 512 MiB."""
    return plain_text(read_limited(path, f"geometry {path}", MEMORY // 4))


def plain_text(data: bytes) -> bytes:
    """Text without a byte order mark, in UTF-8 where it was UTF-16, whose lines end in a line feed, spaces for tabs."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data.decode("utf-16", "replace").encode()
    elif b"\0" in data[:4] and (encoding := bare_utf16(data)):
        data = data.decode(encoding, "replace").encode()
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    data = data.replace(b"\t", b" ")
    return data if data.endswith(b"\n") else data + b"\n"


def numbers_of(text: bytes, where: str, lines: Ints | range, dtype: Any = np.float64) -> NDArray[Any]:
    """All numbers (N,) of `text`, between spaces and line ends; `lines` (L,) has the number of each of its lines.

    Raises:
        InputError: For anything that is no number, with its line.
    """
    if not text.strip():
        return np.zeros(0, dtype)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return np.fromstring(text, dtype, sep=" ")
    except (ValueError, DeprecationWarning):
        raise InputError(_odd_one(text, where, lines, dtype)) from None


def _odd_one(text: bytes, where: str, lines: Ints | range, dtype: Any) -> str:
    whole = np.dtype(dtype).kind in "iu"
    for number, line in zip(lines, text.splitlines(), strict=False):
        for word in line.split():
            try:
                int(word) if whole else float(word)
            except ValueError:
                shown = word[:40].decode("latin-1")
                return f"{where}: line {number}: expected {'whole numbers' if whole else 'numbers'}, got {shown!r}"
    return f"{where}: expected numbers"


class Lines:
    """The lines of a text, by their first word.

    Attributes:
        data: The text, as bytes (M,).
        starts: (L,) where the first word of each line starts; `stops` where its line feed is.
    """

    def __init__(self, text: bytes) -> None:
        self._take(text)
        indented = np.flatnonzero(self._first() == SPACE)
        for _ in range(DEEPEST):
            if not len(indented):
                return
            self.starts[indented] += 1
            indented = indented[self.data[self.starts[indented]] == SPACE]
        self._take(re.sub(rb"(?m)^ +", b"", text))

    def _take(self, text: bytes) -> None:
        self.text, self.data = text, np.frombuffer(text, np.uint8)
        self.stops = np.flatnonzero(self.data == NEWLINE)
        self._begins = np.concatenate([[0], self.stops[:-1] + 1])
        self.starts = self._begins.copy()

    def _first(self) -> NDArray[np.uint8]:
        return self.data[self.starts]

    def __len__(self) -> int:
        return len(self.starts)

    def starting(self, word: bytes) -> NDArray[np.bool_]:
        """(L,) whether each line starts with `word` and a space or its end follows."""
        at = np.flatnonzero(self._first() == word[0])
        for offset, letter in enumerate(word[1:], 1):
            at = at[self._byte(self.starts[at] + offset) == letter]
        following = self._byte(self.starts[at] + len(word))
        found = np.zeros(len(self), dtype=bool)
        found[at[(following == SPACE) | (following == NEWLINE)]] = True
        return found

    def _byte(self, places: Ints) -> NDArray[np.uint8]:
        return self.data[np.minimum(places, len(self.data) - 1)]

    def line(self, index: int) -> str:
        """Returns a line as text."""
        return self.text[self.starts[index] : self.stops[index]].decode("utf-8", "replace").strip()

    def without(self, chosen: NDArray[np.bool_], word: bytes) -> bytes:
        """The lines that are `chosen` (L,), which start with `word`, without it and without comments."""
        lengths = self.stops + 1 - self._begins
        out = self.data[np.repeat(chosen, lengths)].copy()
        starts = np.cumsum(lengths[chosen]) - lengths[chosen] + (self.starts - self._begins)[chosen]
        for offset in range(len(word)):
            out[starts + offset] = SPACE
        text = out.tobytes()
        # in "1.#IND", a number of old compilers, it starts no comment
        return re.sub(rb"(?m)(^| )#[^\n]*", b"", text) if b"#" in text else text


def words_per_line(text: bytes) -> Ints:
    """(L,) how many words each line of a text has."""
    data = np.frombuffer(text, np.uint8)
    gap = (data == SPACE) | (data == NEWLINE)
    first = ~gap
    first[1:] &= gap[:-1]
    stops = np.flatnonzero(data == NEWLINE)
    return np.diff(np.searchsorted(np.flatnonzero(first), stops), prepend=0)


def require_words(counts: Ints, expected: Sequence[int], where: str, lines: Ints, what: str) -> None:
    """Raise `InputError` for the first of the lines (L,) whose count of words (L,) is none of the expected."""
    odd = np.flatnonzero(~np.isin(counts, expected))
    if len(odd):
        wanted = " or ".join(map(str, expected))
        raise InputError(f"{where}: line {lines[odd[0]]}: expected {wanted} {what}, got {counts[odd[0]]}")
