"""Series of integers as few bytes: differenced in time, split into byte planes, and compressed by LZMA.

The codec is not numcodecs', whose delta filter has one order for all series; the order is chosen per series here.
"""

import lzma
import struct

import numpy as np
from numpy.typing import NDArray

from odeform.budget import require_memory
from odeform.errors import InputError

__all__ = ["decompressed", "expanded", "from_planes", "planes_of", "squeezed"]

HEADER = struct.Struct("<IId")  # frames, series, rate in Hz
ORDERS = 4  # of differences in time, zeroth to third
INTEGER_BYTES = 40  # of memory for a number of a series while it is expanded
LIMIT = 1 << 28  # bytes, decompressed

Integers = NDArray[np.int64]


def decompressed(data: bytes) -> bytes:
    """Decompresses LZMA, up to a limit of 256 MiB. Raises `LZMAError` for damaged bytes."""
    return lzma.LZMADecompressor(memlimit=LIMIT).decompress(data, max_length=LIMIT)


def planes_of(values: Integers) -> bytes:
    """Maps integers (A, B) of 32 bits to the four planes of their bytes. `InputError` for larger ones."""
    limits = np.iinfo(np.int32)
    if values.size and (values.min() < limits.min or values.max() > limits.max):
        raise InputError("pack: the tolerance is too small for motions this large")
    planes = values.astype("<i4").view(np.uint8).reshape(*values.shape, 4)
    return np.moveaxis(planes, -1, 0).tobytes()


def from_planes(planes: NDArray[np.uint8], shape: tuple[int, int]) -> Integers:
    """Inverts `planes_of`, for values (A, B) of that shape. Raises `ValueError` for another length."""
    values = np.ascontiguousarray(np.moveaxis(planes.reshape(4, *shape), 0, -1)).view("<i4")
    return values[..., 0].astype(np.int64)


def squeezed(values: Integers, rate: float) -> bytes:
    """(T, S) integers at `rate` Hz -> bytes: each series in the order of differences that is cheapest for it."""
    residuals = [values]
    for _ in range(1, ORDERS):
        residuals.append(np.diff(residuals[-1], axis=0, prepend=0))
    cost = np.array([np.log2(1.0 + np.abs(r)).sum(axis=0) for r in residuals])
    orders = cost.argmin(axis=0)
    chosen = np.stack([residuals[order][:, s] for s, order in enumerate(orders)])
    body = orders.astype(np.uint8).tobytes() + planes_of(chosen)
    return lzma.compress(HEADER.pack(*values.shape, rate) + body, preset=9)


def expanded(data: bytes) -> tuple[Integers, float]:
    """Inverts `squeezed`. Raises `LZMAError`, `struct.error` or `ValueError` for damaged bytes."""
    body = decompressed(data)
    frames, series, rate = HEADER.unpack_from(body)
    require_memory("sequence", f"{frames:,} frames of {series:,} series", INTEGER_BYTES * frames * series)
    if not (frames and series and 0.0 < rate < float("inf")):
        raise ValueError("no frames, or no frame rate")
    orders, planes = np.split(np.frombuffer(body, np.uint8, offset=HEADER.size), [series])
    if orders.max() >= ORDERS:
        raise ValueError("invalid order of differences")
    values = from_planes(planes, (series, frames))
    for s, order in enumerate(orders):
        for _ in range(int(order)):
            values[s] = np.cumsum(values[s])
    return values.T, rate
