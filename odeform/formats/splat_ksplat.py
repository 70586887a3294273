"""Gaussian splats of GaussianSplats3D, .ksplat: sections of splats, whose centres may be relative to those of buckets.

https://github.com/mkkellogg/GaussianSplats3D, `SplatBuffer.js`
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from odeform.budget import MEMORY, read_limited, require_memory
from odeform.errors import InputError
from odeform.geometry.ellipsoids import covariances_from_axes
from odeform.types import SH0, Floats, GaussianSplats, Harmonics, Ints

__all__ = ["read_ksplat"]

HEADER, SECTION = 4096, 1024  # bytes
COEFFICIENTS = (0, 9, 24, 45)  # numbers of further harmonics, by degree
SPLAT_BYTES = 600  # of memory while reading
RANGE = 1.5  # of harmonics in bytes, where the header gives none
MAIN = np.dtype(
    {
        "names": ["major", "minor", "room", "sections", "splats", "level", "low", "high"],
        "formats": ["u1", "u1", "<u4", "<u4", "<u4", "<u2", "<f4", "<f4"],
        "offsets": [0, 1, 4, 8, 16, 20, 36, 40],
        "itemsize": HEADER,
    }
)
PART = np.dtype(
    {
        "names": ["splats", "room", "capacity", "buckets", "block", "stored", "range", "full", "partial", "degree"],
        "formats": ["<u4", "<u4", "<u4", "<u4", "<f4", "<u2", "<u4", "<u4", "<u4", "<u2"],
        "offsets": [0, 4, 8, 12, 16, 20, 24, 32, 36, 40],
        "itemsize": SECTION,
    }
)


@dataclass(frozen=True)
class _Level:
    """How numbers are stored: of centres, of scales and rotations, and of harmonics."""

    centre: str
    shape: str
    harmonic: str

    def row(self, degree: int) -> np.dtype[np.void]:
        """The layout of a splat."""
        fields = [("xyz", self.centre, 3), ("scale", self.shape, 3), ("rot", self.shape, 4), ("rgba", "u1", 4)]
        count = COEFFICIENTS[degree]
        return np.dtype([*fields, *([("sh", self.harmonic, count)] if count else [])])


LEVELS = (_Level("<f4", "<f4", "<f4"), _Level("<u2", "<f2", "<f2"), _Level("<u2", "<f2", "u1"))


def read_ksplat(path: Path, merge: bool) -> GaussianSplats:
    """Reads the splats of all sections, with the harmonics of the highest degree among them.

    Raises:
        InputError: For other versions, and a file that is cut short.
    """
    where = f"geometry {path}"
    data = read_limited(path, where, MEMORY // 4)
    if len(data) < HEADER:
        raise InputError(f"{where}: expected a header of {HEADER} bytes, got {len(data):,}: truncated?")
    head = np.frombuffer(data, MAIN, 1)[0]
    if head["major"] != 0 or head["minor"] < 1 or head["level"] > 2:
        got = f"version {head['major']}.{head['minor']} and level {head['level']}"
        raise InputError(f"{where}: expected .ksplat of version 0.1 and compression level 0 to 2, got {got}")
    room = int(head["room"])
    start = HEADER + SECTION * room
    if len(data) < start:
        raise InputError(f"{where}: expected {room:,} headers of sections, got {len(data):,} bytes: truncated?")
    require_memory(where, f"{int(head['splats']):,} splats", SPLAT_BYTES * int(head["splats"]))
    level, parts = LEVELS[head["level"]], []
    limits = float(head["low"]) or -RANGE, float(head["high"]) or RANGE
    for part in np.frombuffer(data, PART, room, HEADER):
        if part["degree"] > 3:
            raise InputError(f"{where}: expected harmonics of degree 3 at most, got {part['degree']}")
        if part["splats"]:
            parts.append(_section(data, start, part, level, limits, where))
        row = level.row(int(part["degree"]))
        start += (
            row.itemsize * int(part["room"]) + int(part["stored"]) * int(part["buckets"]) + 4 * int(part["partial"])
        )
    count = sum(len(points) for points, *_ in parts)
    if count != head["splats"] or not parts:
        raise InputError(f"{where}: expected {head['splats']:,} splats, got {count:,} in its sections")
    points, covariances, harmonics, opacities = zip(*parts, strict=True)
    most = max(part.shape[1] for part in harmonics)
    return GaussianSplats(
        np.concatenate(points),
        np.concatenate(covariances),
        np.concatenate([np.pad(part, ((0, 0), (0, most - part.shape[1]), (0, 0))) for part in harmonics]),
        np.concatenate(opacities),
    )


def _section(
    data: bytes, start: int, part: np.void, level: _Level, limits: tuple[float, float], where: str
) -> tuple[Floats, Floats, Harmonics, Floats]:
    """Points, covariances, harmonics and opacities of a section whose data begins at `start`."""
    count, partial, stored = int(part["splats"]), 4 * int(part["partial"]), int(part["stored"])
    row = level.row(int(part["degree"]))
    rows = start + partial + stored * int(part["buckets"])
    if rows + row.itemsize * count > len(data):
        raise InputError(f"{where}: expected {count:,} splats in a section, got fewer: truncated?")
    table = np.frombuffer(data, row, count, rows)
    points = table["xyz"].astype(float)
    if level.centre != "<f4":
        centres = np.frombuffer(data, "<f4", (rows - start - partial) // 4, start + partial)
        sizes = np.frombuffer(data, "<u4", int(part["partial"]), start)
        half = float(part["range"] or 32767)
        points = (points - half) * (float(part["block"]) / 2.0 / half) + _of_buckets(
            part, sizes, centres, stored, where
        )
    colors = table["rgba"] / np.float32(255.0)
    harmonics = ((colors[:, None, :3] - 0.5) / SH0).astype(np.float32)
    if row.names is not None and "sh" in row.names:
        harmonics = np.concatenate([harmonics, _further(table["sh"], level, limits)], axis=1)
    covariances = covariances_from_axes(np.abs(table["scale"].astype(float)), table["rot"].astype(float))
    return points.astype(np.float32), covariances, harmonics, colors[:, 3]


def _of_buckets(part: np.void, sizes: Ints, centres: Floats, stored: int, where: str) -> Floats:
    """(N, 3) centre of the bucket of each splat: full ones first, then those of `sizes`."""
    count, capacity, full = int(part["splats"]), int(part["capacity"]), int(part["full"])
    number = np.concatenate([np.full(min(full, count), capacity), sizes]).astype(np.int64)
    bucket = np.repeat(np.arange(len(number)), np.minimum(number, count))[:count]
    if stored < 12 or stored % 4 or len(bucket) < count or len(number) > len(centres) * 4 // stored:
        raise InputError(f"{where}: expected buckets of {count:,} splats, got {len(bucket):,} in {part['buckets']:,}")
    return centres.reshape(-1, stored // 4)[bucket, :3].astype(float)


def _further(raw: NDArray[np.generic], level: _Level, limits: tuple[float, float]) -> Harmonics:
    """(N, H, 3) coefficients: of each degree all of red, then green, then blue."""
    values = raw.astype(np.float32)
    if level.harmonic == "u1":
        values = limits[0] + values / 255.0 * (limits[1] - limits[0])
    parts, first = [], 0
    for degree in range(1, COEFFICIENTS.index(values.shape[1]) + 1):
        size = 2 * degree + 1
        parts.append(values[:, first : first + 3 * size].reshape(-1, 3, size).swapaxes(1, 2))
        first += 3 * size
    return np.concatenate(parts, axis=1).astype(np.float32)
