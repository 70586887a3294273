"""Finds which files are the frames of a sequence, and what their names say of order and time."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from itertools import pairwise
from pathlib import Path

import numpy as np

from odeform.dataset.importers.even_steps import even_step, short
from odeform.errors import InputError

__all__ = ["Numbered", "numbered_frames"]

SEPARATED = r"(?:^|(?<=[\s_.,=+(\[-]))-"  # a minus behind a letter or a digit separates
MANTISSA = r"(?:\d+(?:[.,]\d+)?|(?<![\w.])\.\d+|(?<=_)\.\d+)"
NUMBER = (
    r"(?<![A-Za-z0-9.,])(?:{minus})?" + MANTISSA + r"[eE][+-]\d+(?![A-Za-z0-9])"  # behind a letter, e- may be a name
    r"|(?:{minus})?" + MANTISSA
)
NUMBERS = re.compile(NUMBER.format(minus=SEPARATED), re.ASCII)
SIGNED = re.compile(NUMBER.format(minus="-"), re.ASCII)
INTEGERS = re.compile(r"\d+", re.ASCII)
FARTHEST = 300  # powers of ten
SHOWN = 4  # names in a message
TIMES = "; if that is meant, give the times of the frames in a table times.csv"


@dataclass(frozen=True)
class Numbered:
    """Frames in the order of the numbers in their names.

    Attributes:
        files: The frames (T).
        numbers: Their numbers (T), which increase.
        decimal: Whether any of them has a decimal point or an exponent, as times have.
        step: The distance of the numbers where they are even; None where they are not.
    """

    files: tuple[Path, ...]
    numbers: tuple[float, ...]
    decimal: bool
    step: float | None


@dataclass(frozen=True)
class _Name:
    """A name as text around numbers."""

    path: Path
    text: tuple[str, ...]
    numbers: tuple[str, ...]


def numbered_frames(files: Sequence[Path], where: str) -> Numbered:
    """The frames by the one number that varies in their names. Raises `InputError`, which `where` leads, for names
    that differ in more, for frames that are there twice, and for numbers that are missing between others."""
    names = [_parsed(path, NUMBERS) for path in files]
    if len({name.text for name in names}) > 1:  # f-1, f0: the minus is a sign
        signed = [_parsed(path, SIGNED) for path in files]
        names = signed if len({name.text for name in signed}) == 1 else names
    _require_one_name(names, where)
    if len(names) == 1:
        return Numbered(tuple(files), (0.0,), False, None)
    column = _varying(names, where)
    if _mixed_widths([name.numbers[column] for name in names]):  # take.1.9, take.1.10: the point separates
        parts = [_parsed(path, INTEGERS) for path in files]
        if len({name.text for name in parts}) == 1 and len(_varying_columns(parts)) == 1:
            names, column = parts, _varying_columns(parts)[0]
    values = sorted(((_value(name.numbers[column], where), name) for name in names), key=lambda pair: pair[0])
    for (one, first), (two, second) in pairwise(values):
        if one == two:
            raise InputError(f"{where}: {first.path.name} and {second.path.name} are both frame {short(float(one))}")
    numbers = tuple(float(value) for value, _ in values)
    decimal = any(re.search(r"[.,eE]", name.numbers[column]) for name in names)
    first = values[0][0]
    from_first = np.array([float(value - first) for value, _ in values])  # integers of many digits stay exact
    rounding = min(10.0 ** int(value.as_tuple().exponent) for value, _ in values) if decimal else 0.0
    shown = [name.path.name for _, name in values]
    step = even_step(from_first, where, shown, decimal, rounding, float(first), TIMES)
    return Numbered(tuple(name.path for _, name in values), numbers, decimal, step)


def _parsed(path: Path, pattern: re.Pattern[str]) -> _Name:
    text, numbers, end = [], [], 0
    for found in pattern.finditer(path.stem):
        text.append(re.sub(" +", " ", path.stem[end : found.start()].casefold()))  # numbers may be padded by spaces
        numbers.append(found[0])
        end = found.end()
    return _Name(path, (*text, path.stem[end:].casefold()), tuple(numbers))


def _require_one_name(names: list[_Name], where: str) -> None:
    """All names have the same text around their numbers; those of the smaller groups are named."""
    (usual, _), *others = Counter(name.text for name in names).most_common()
    if not others:
        return
    example = next(name.path.name for name in names if name.text == usual)
    odd = [name.path.name for name in names if name.text != usual]
    more = f" and {len(odd) - SHOWN} more" if len(odd) > SHOWN else ""
    raise InputError(
        f"{where}: expected one sequence, whose names differ in one number, as in {example}; got also "
        f"{', '.join(odd[:SHOWN])}{more}: copies, or frames of another sequence?"
    )


def _varying_columns(names: list[_Name]) -> list[int]:
    columns = zip(*(name.numbers for name in names), strict=True)
    return [index for index, column in enumerate(columns) if len(set(column)) > 1]


def _varying(names: list[_Name], where: str) -> int:
    """Finds which number of the names counts the frames. Others may grow with it, as in frame_0010_0.25s."""
    varying = _varying_columns(names)
    first, second = (name.path.name for name in names[:2])
    if len(varying) == 1:
        return varying[0]
    if not varying:
        raise InputError(f"{where}: expected a number in the name of each frame, got {first} and {second}")
    found: list[tuple[bool, bool, int]] = []
    for index in varying:
        rows = sorted([_value(name.numbers[column], where) for column in (index, *varying)] for name in names)
        steps = {float(two[0] - one[0]) for one, two in pairwise(rows)}
        if min(steps) > 0.0 and all(a <= b for one, two in pairwise(rows) for a, b in zip(one, two, strict=True)):
            found.append((len(steps) > 1, not all(name.numbers[index].isdecimal() for name in names), index))
    if not found:
        raise InputError(
            f"{where}: expected one number that counts the frames, got {len(varying)} that vary, "
            f"as in {first} and {second}"
        )
    return min(found)[2]


def _mixed_widths(numbers: list[str]) -> bool:
    """Whether decimals end in zeros that not all have: nothing prints times so."""
    fractions = [re.split("[.,]", number)[1] for number in numbers if re.fullmatch(r"\d+[.,]\d+", number)]
    if len(fractions) < len(numbers) or len(set(map(len, fractions))) == 1:
        return False
    return any(len(fraction) > 1 and fraction.endswith("0") for fraction in fractions)


def _value(number: str, where: str) -> Decimal:
    try:
        value = Decimal(number.replace(",", "."))
    except InvalidOperation:  # an exponent of many digits
        value = Decimal("inf")
    if not value.is_finite() or abs(value.adjusted()) > FARTHEST:
        raise InputError(f"{where}: expected numbers of frames of a plausible size, got {number}")
    return value
