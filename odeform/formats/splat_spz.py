"""Niantic's .spz: quantised Gaussian splats, versions 1 to 4 (https://github.com/nianticlabs/spz).

Attributes are stored one after the other. Versions up to 3 are one gzip stream, which some tools omit; version 4 has a
zstandard stream per attribute behind a table of their sizes. The format stores x right, y up, z backward; splats are
returned as in the .ply of the same capture, x right, y down, z forward.
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import replace
from gzip import compress
from pathlib import Path
from typing import NamedTuple

import numpy as np
import zstandard
from numpy.typing import NDArray

from odeform.budget import MEMORY, read_limited, require_memory
from odeform.errors import InputError
from odeform.geometry.ellipsoids import axes_from_covariances, covariances_from_axes, with_fourth
from odeform.geometry.harmonics import rotated_harmonics
from odeform.geometry.parts import subset
from odeform.types import Floats, GaussianSplats

__all__ = ["read_spz", "spz_bytes", "spz_splats"]

Bytes = NDArray[np.uint8]

MAGIC = b"NGSP"
HEADER = struct.Struct("<4sIIBBBB")  # magic, version, splats, degree, fractional bits, flags, streams
MAX_DEGREE = 3  # of harmonics; no viewer shows more
EXTENDED = 2  # flag: vendor extensions follow
COLOR_SCALE = 0.15  # a colour byte is 255 * (0.5 + COLOR_SCALE * constant harmonic)
MAX_RATIO = 1024  # of compression
BLOCK = 1 << 16  # splats at a time
SPLAT_BYTES, HARMONIC_BYTES = 240, 34  # of memory while reading: a splat, and each of its harmonics
AXES = np.diag([1.0, -1.0, -1.0])


class Header(NamedTuple):
    """The header of all versions; `streams` is used in version 4 only."""

    magic: bytes
    version: int
    splats: int
    degree: int
    fraction: int
    flags: int
    streams: int

    @property
    def widths(self) -> list[int]:
        """Bytes per splat of position, opacity, colour, scales, rotation and further harmonics, in file order."""
        position, rotation = 6 if self.version == 1 else 9, 3 if self.version < 3 else 4
        return [position, 1, 3, 3, rotation, 3 * ((self.degree + 1) ** 2 - 1)]


def read_spz(path: Path, merge: bool) -> GaussianSplats:
    """Reads all splats of a file, x right, y down, z forward."""
    return spz_splats(read_limited(path, f"geometry {path}", MEMORY >> 1), path)


def spz_splats(data: bytes, path: Path) -> GaussianSplats:
    """Reads the splats in the bytes of a file. Raises `InputError`, which names `path`, for damaged ones."""
    header, body = _unpacked(data, path)
    count, widths = header.splats, header.widths
    if len(body) < count * sum(widths):
        raise InputError(f"geometry {path}: expected {count * sum(widths)} bytes of {count} splats, got {len(body)}")
    ends = np.cumsum([count * width for width in widths])
    raw = np.frombuffer(body, np.uint8)
    parts = [raw[end - count * width : end].reshape(count, width) for end, width in zip(ends, widths, strict=True)]
    kept = min(header.degree, MAX_DEGREE)
    splats = GaussianSplats(
        np.empty((count, 3), np.float32),
        np.empty((count, 3, 3)),
        np.empty((count, (kept + 1) ** 2, 3), np.float32),
        np.empty(count, np.float32),
        tuple(_notes(header)),
    )
    for start in range(0, count, BLOCK):
        _decode(header, [part[start : start + BLOCK] for part in parts], subset(splats, slice(start, start + BLOCK)))
    return replace(splats, harmonics=rotated_harmonics(splats.harmonics, AXES))


def _notes(header: Header) -> Iterator[str]:
    if header.degree > MAX_DEGREE:
        yield f"colour beyond degree {MAX_DEGREE} left out"
    if header.flags & EXTENDED:
        yield "vendor extensions left out"


def _decode(header: Header, parts: list[Bytes], out: GaussianSplats) -> None:
    """Write the splats of these bytes into arrays, which are views."""
    points, alphas, colors, scales, rotations, further = parts
    quaternions = _three_bytes(rotations) if header.version < 3 else _smallest_three(rotations)
    out.points[:] = _positions(points, header) @ AXES
    out.covariances[:] = AXES @ covariances_from_axes(np.exp(scales / 16.0 - 10.0), quaternions) @ AXES
    out.harmonics[:, 0] = (colors / 255.0 - 0.5) / COLOR_SCALE
    count = out.harmonics.shape[1] - 1
    out.harmonics[:, 1:] = (further[:, : 3 * count].reshape(len(further), count, 3) - 128.0) / 128.0
    out.opacities[:] = alphas[:, 0] / 255.0


def spz_bytes(splats: GaussianSplats, fraction: int = 12) -> bytes:
    """Encodes splats of one colour each in a file of version 3, with positions rounded to 2^-`fraction` of a unit.

    Raises `ValueError` for further harmonics.
    """
    if splats.harmonics.shape[1] != 1:
        raise ValueError(f"expected the constant harmonic alone, got {splats.harmonics.shape[1]} coefficients")
    scales, quaternions = axes_from_covariances(AXES @ splats.covariances @ AXES)
    header = HEADER.pack(MAGIC, 3, len(splats.points), 0, fraction, 0, 0)
    parts = [
        np.rint((splats.points @ AXES) * 2.0**fraction).astype("<i4").view(np.uint8).reshape(-1, 4)[:, :3],
        _byte(255.0 * splats.opacities),
        _byte(255.0 * (0.5 + COLOR_SCALE * splats.harmonics[:, 0])),
        _byte(16.0 * (np.log(np.maximum(scales, 1e-9)) + 10.0)),
        _packed_rotations(quaternions),
    ]
    # no time stamp: equal splats give equal bytes
    return compress(header + b"".join(part.tobytes() for part in parts), mtime=0)


def _unpacked(data: bytes, path: Path) -> tuple[Header, bytes]:
    """The header and the decompressed attributes."""
    gzip = zlib.decompressobj(wbits=31) if data.startswith(b"\x1f\x8b") else None
    head = gzip.decompress(data, HEADER.size) if gzip else data[: HEADER.size]
    if len(head) < HEADER.size or not head.startswith(MAGIC):
        raise InputError(f"geometry {path}: expected a header that starts with NGSP, got {head[:4]!r}")
    header = Header(*HEADER.unpack(head))
    if not 1 <= header.version <= (3 if gzip else 4):
        raise InputError(f"geometry {path}: expected .spz version 1 to 4, got {header.version}")
    if header.degree > 4 or header.fraction > 23:
        got = f"degree {header.degree} and {header.fraction} bits"
        raise InputError(f"geometry {path}: expected harmonics of degree 4 and 23 fractional bits at most, got {got}")
    size = header.splats * sum(header.widths)
    if size > MAX_RATIO * len(data):
        raise InputError(f"geometry {path}: {len(data)} bytes cannot hold {header.splats} splats")
    harmonics = (header.degree + 1) ** 2
    require_memory(
        f"geometry {path}", f"{header.splats:,} splats", header.splats * (SPLAT_BYTES + HARMONIC_BYTES * harmonics)
    )
    if header.version == 4:
        return header, _streams(data, header, path)
    return header, gzip.decompress(gzip.unconsumed_tail, max(size, 1)) if gzip else data[HEADER.size :]


def _streams(data: bytes, header: Header, path: Path) -> bytes:
    """The decompressed attributes of version 4."""
    sizes = [header.splats * width for width in header.widths if header.splats * width]
    if header.streams != len(sizes) or len(data) < 32:
        raise InputError(f"geometry {path}: expected {len(sizes)} streams of .spz, got {header.streams}")
    (table,) = struct.unpack_from("<I", data, 16)
    start = table + 16 * len(sizes)
    if table < 32 or start > len(data):
        raise InputError(f"geometry {path}: expected a stream table within {len(data)} bytes, got one at {table}")
    parts = []
    for index, size in enumerate(sizes):
        packed, unpacked = struct.unpack_from("<QQ", data, table + 16 * index)
        with zstandard.ZstdDecompressor().stream_reader(data[start : start + packed]) as reader:
            part = reader.read(size)
        if len(part) < size or unpacked != size:
            raise InputError(f"geometry {path}: expected {size} bytes in stream {index + 1}, got {len(part)}")
        parts.append(part)
        start += packed
    return b"".join(parts)


def _positions(raw: Bytes, header: Header) -> Floats:
    """(N, 3) from (N, 9) bytes of 24-bit fixed-point numbers, or in version 1 from (N, 6) bytes of half floats."""
    if header.version == 1:
        return np.ascontiguousarray(raw).view("<f2").astype(float)
    low, middle, high = np.moveaxis(raw.reshape(-1, 3, 3).astype(np.int32), -1, 0)
    # the highest byte has the sign
    return (low + (middle << 8) + (high.astype(np.uint8).view(np.int8).astype(np.int32) << 16)) * 2.0**-header.fraction


def _three_bytes(raw: Bytes) -> Floats:
    """(N, 3) bytes x, y, z -> (N, 4), w first."""
    return np.roll(with_fourth(raw / 127.5 - 1.0, np.full(len(raw), 3)), 1, axis=1)


def _smallest_three(raw: Bytes) -> Floats:
    """(N, 4) bytes of a word: index of the largest of x, y, z, w, then a sign and 9 bits per other one -> w first."""
    word = np.ascontiguousarray(raw).view("<u4")[:, 0]
    fields = np.stack([word >> 20, word >> 10, word], axis=1)
    size = (fields & 511) / 511.0 * np.sqrt(0.5)
    return np.roll(with_fourth(np.where(fields & 512, -size, size), word >> 30), 1, axis=1)


def _byte(values: Floats) -> Bytes:
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def _packed_rotations(quaternions: Floats) -> Bytes:
    """The inverse of `_smallest_three`."""
    xyzw = np.roll(quaternions, -1, axis=1)
    largest = np.abs(xyzw).argmax(axis=1)
    rows = np.arange(len(xyzw))
    xyzw = xyzw * np.where(xyzw[rows, largest] < 0.0, -1.0, 1.0)[:, None]
    others = xyzw[np.arange(4) != largest[:, None]].reshape(-1, 3)
    size = np.rint(np.minimum(np.abs(others) * np.sqrt(2.0), 1.0) * 511).astype(np.uint32)
    fields = size | (others < 0.0).astype(np.uint32) << 9
    word = largest.astype(np.uint32) << 30 | fields[:, 0] << 20 | fields[:, 1] << 10 | fields[:, 2]
    return word.astype("<u4").view(np.uint8).reshape(-1, 4)
