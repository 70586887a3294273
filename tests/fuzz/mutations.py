"""Random damage to a file: bytes for all formats, values for JSON, words for text."""

import json
import re
from copy import deepcopy
from typing import Any

import numpy as np

__all__ = ["mutated", "mutated_json"]

Random = np.random.Generator

WORDS = (b"nan", b"inf", b"-1", b"0", b"1e39", b"3e38", b"1e-40", b"1e400", b"99999999999999999999", b"", b"x" * 400)
NUMBERS = (0, 1, 0x7F, 0xFF, 0x7FFFFFFF, 0xFFFFFFFF, 0x7FFFFFFFFFFFFFFF)
VALUES: tuple[Any, ...] = (
    *(None, True, -1, 0, 0.5, 1e300, -1e300, 10**350, float("nan"), float("inf"), "", "x" * 400, "\0", "../x", [], {}),
    *([[]], [1, 2, 3], {"a": 1}, 10**9, "1", 1e-320),
)


def mutated(data: bytes, random: Random) -> bytes:
    """A copy with one to four changes."""
    out = bytearray(data)
    for _ in range(random.integers(1, 5)):
        out = bytearray(CHANGES[random.integers(len(CHANGES))](out, random))
    return bytes(out)


def _place(data: bytearray, random: Random) -> int:
    """A position; half of them in the first 512 bytes, where headers are."""
    most = min(len(data), 512) if random.random() < 0.5 else len(data)
    return int(random.integers(most + 1))


def _flip(data: bytearray, random: Random) -> bytes:
    for _ in range(random.integers(1, 9)):
        if data:
            data[_place(data, random) % len(data)] ^= 1 << int(random.integers(8))
    return data


def _number(data: bytearray, random: Random) -> bytes:
    place, size = _place(data, random), int(random.choice([1, 2, 4, 8]))
    value = NUMBERS[random.integers(len(NUMBERS))] & ((1 << 8 * size) - 1)
    return data[:place] + value.to_bytes(size, "little") + data[place + size :]


def _cut(data: bytearray, random: Random) -> bytes:
    return data[: _place(data, random)]


def _remove(data: bytearray, random: Random) -> bytes:
    place = _place(data, random)
    return data[:place] + data[place + int(random.integers(1, 64)) :]


def _repeat(data: bytearray, random: Random) -> bytes:
    place = _place(data, random)
    return data[:place] + data[place : place + int(random.integers(1, 256))] * 2 + data[place:]


def _random(data: bytearray, random: Random) -> bytes:
    place = _place(data, random)
    return data[:place] + random.bytes(int(random.integers(1, 64))) + data[place:]


def _word(data: bytearray, random: Random) -> bytes:
    found = list(re.finditer(rb"-?[0-9][0-9.eE+-]*", data[: 1 << 16]))
    if not found:
        return data
    start, end = found[random.integers(len(found))].span()
    return data[:start] + WORDS[random.integers(len(WORDS))] + data[end:]


CHANGES = (_flip, _number, _cut, _remove, _repeat, _random, _word, _word)


def mutated_json(value: Any, random: Random) -> bytes:
    """A JSON text in which one to three values are others, missing, or nested far too deeply."""
    value = json.loads(json.dumps(value))
    for _ in range(random.integers(1, 4)):
        _change(value, random)
    text = json.dumps(value).encode()
    return text.replace(b'"deep"', b"[" * 100_000 + b"]" * 100_000)


def _change(value: Any, random: Random) -> None:
    while isinstance(value, dict | list) and value:
        keys = list(value) if isinstance(value, dict) else range(len(value))
        key = keys[random.integers(len(keys))]
        if not isinstance(value[key], dict | list) or not value[key] or random.random() < 0.2:
            choice = int(random.integers(len(VALUES) + 2))
            if choice == len(VALUES):
                del value[key]
            else:
                value[key] = "deep" if choice > len(VALUES) else deepcopy(VALUES[choice])
            return
        value = value[key]
