"""The text in a file, whatever wrote it: UTF-8 or UTF-16 with or without a byte order mark, or Windows-1252."""

from odeform.errors import InputError

__all__ = ["bare_utf16", "decoded"]

NOT_TEXT = {
    b"PK\x03\x04": "an Excel or OpenDocument workbook, or another zip file: save the table as CSV",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook: save the table as CSV",
    b"\x1f\x8b": "a gzip archive: unpack it first",
    b"version https://git-lfs": "a pointer of Git LFS, not the file itself: run `git lfs pull`",
    b"<!DOCTYPE": "a web page, not the file itself",
    b"<html": "a web page, not the file itself",
}
UTF16 = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


def decoded(data: bytes, where: str) -> tuple[str, tuple[str, ...]]:
    """The text of `data`, and a note if its encoding had to be guessed.

    Raises `InputError`, which `where` leads, for what is no text: the message says what it is, or at which byte.
    """
    for start, what in NOT_TEXT.items():
        if data[: len(start)].lower() == start.lower():
            raise InputError(f"{where}: expected text, got {what}")
    encoding = UTF16.get(data[:2]) or bare_utf16(data)
    notes: tuple[str, ...] = ()
    try:
        text = data.decode(encoding or "utf-8")
    except UnicodeDecodeError as error:
        if encoding:
            raise InputError(f"{where}: expected {encoding.upper()} text, byte {error.start} is none") from None
        notes = (f"{where}: not UTF-8; read as Windows-1252",)
        try:
            text = data.decode("cp1252")
        except UnicodeDecodeError as other:
            raise InputError(
                f"{where}: expected text in UTF-8, UTF-16 or Windows-1252, byte {other.start} is in none"
            ) from None
    if "\0" in text:
        raise InputError(f"{where}: expected text, got a zero character at {text.index(chr(0))}")
    return text.removeprefix("\ufeff"), notes


def bare_utf16(data: bytes) -> str:
    """The encoding of UTF-16 without a byte order mark, of mostly Latin letters: every other byte is zero. Empty for
    anything else."""
    head = data[:512]
    zeros = head[0::2].count(0), head[1::2].count(0)
    if len(data) % 2 or 4 * max(zeros) < len(head):
        return ""
    return "utf-16-be" if zeros[0] > zeros[1] else "utf-16-le"
