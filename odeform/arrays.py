"""Arrays of checkpoints: checked as they are read, and in as few bytes as their precision needs.

An array in steps has rows that are multiples of their `NAME.step`. A file holds the integers: signs in the last bit,
so that small ones have small codes, split into planes of bytes, and deflated.
"""

import zlib
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, UInt8

from odeform.types import Arrays, Floats

__all__ = ["STEP", "finite_arrays", "in_steps", "packed", "row_steps", "unpacked"]

STEP = ".step"
COARSEST = 32  # steps at least to the largest value of a row
FINEST = 1 << 22  # and at most, so that single precision holds every multiple
STRATEGIES = (zlib.Z_RLE, zlib.Z_DEFAULT_STRATEGY)
PLANES = 4  # bytes of an integer

Steps = Float[np.ndarray, " rows"]


def finite_arrays(arrays: Arrays, prefix: str, shapes: Mapping[str, tuple[int, ...]]) -> Arrays:
    """Returns the arrays that `shapes` names, without their `prefix`, in double precision.

    KeyError where one is missing, ValueError where one is not finite or has another shape.
    """
    found = {name: arrays[prefix + name].astype(float) for name in shapes}
    for name, shape in shapes.items():
        if found[name].shape != shape or not np.isfinite(found[name]).all():
            raise ValueError(f"{prefix}{name}: expected a finite array of shape {shape}, got {found[name].shape}")
    return found


def row_steps(sizes: Steps, noise: float) -> Steps:
    """Returns the steps (R,) of rows that are summed up with coefficients of root mean square `sizes` (R,), by which
    rounding adds `noise` (RMS) to each entry of the sum; every row adds the same."""
    return noise * np.sqrt(12.0 / len(sizes)) / np.maximum(sizes, np.finfo(float).tiny)


def in_steps(name: str, values: Floats, steps: Steps) -> Arrays:
    """Returns an array (R, ...) rounded to multiples of the steps (R,) of its rows, and these, as a checkpoint names
    them. A row keeps 5 bits at least, and 22 at most. What is not finite has no steps, and stays as it is:
    whoever reads it refuses it."""
    if not np.isfinite(values).all():
        return {name: values.astype(np.float32)}
    largest = np.abs(values).reshape(len(values), -1).max(axis=1, initial=0.0)
    steps = np.clip(steps, largest / FINEST, largest / COARSEST)
    steps[largest == 0.0] = 1.0
    shaped = _by_row(steps, values.ndim)
    return {name: (np.rint(values / shaped) * shaped).astype(np.float32), f"{name}{STEP}": steps}


def packed(values: Floats, steps: Steps) -> UInt8[np.ndarray, " bytes"]:
    """Packs an array (R, ...) of multiples of `steps` (R,). `ValueError` for what is not finite."""
    if not np.isfinite(values).all():
        raise ValueError("expected finite numbers")
    integers = np.rint(values / _by_row(steps, values.ndim)).astype(np.int32)
    codes = ((integers << 1) ^ (integers >> 31)).astype("<u4").reshape(-1)
    planes = np.ascontiguousarray(codes.view(np.uint8).reshape(-1, PLANES).T)
    # modes are noise in which nothing repeats but zeros; motions that rest do repeat
    smallest = min((_deflated(planes.tobytes(), strategy) for strategy in STRATEGIES), key=len)
    return np.frombuffer(smallest, np.uint8)


def unpacked(data: UInt8[np.ndarray, " bytes"], shape: Sequence[int], steps: Steps) -> Floats:
    """Unpacks an array of that shape, (R, ...), in single precision; the inverse of `packed`.

    `zlib.error` or `ValueError` for damaged bytes, or another shape. The shape is trusted: the caller limits it.
    """
    if not shape or steps.shape != (shape[0],):
        raise ValueError(f"expected a step for each row, got shape {shape} and steps of shape {steps.shape}")
    size = PLANES * int(np.prod(shape, dtype=np.int64))
    reader = zlib.decompressobj()
    planes = np.frombuffer(reader.decompress(data.tobytes(), size + 1), np.uint8)
    if not reader.eof:
        raise ValueError(f"expected {size} bytes")
    codes = np.ascontiguousarray(planes.reshape(PLANES, -1).T).view("<u4").reshape(shape)
    integers = (codes >> 1).astype(np.int32) ^ -(codes & 1).astype(np.int32)
    return (integers * _by_row(steps, len(shape))).astype(np.float32)


def _deflated(data: bytes, strategy: int) -> bytes:
    writer = zlib.compressobj(9, strategy=strategy)
    return writer.compress(data) + writer.flush()


def _by_row(steps: Steps, dimensions: int) -> Floats:
    """(R, 1, ...) of (R,)."""
    return steps.reshape(-1, *[1] * (dimensions - 1))
