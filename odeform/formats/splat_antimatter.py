"""Gaussian splats of 32 bytes each (https://github.com/antimatter15/splat): one colour, linear scales."""

from pathlib import Path

import numpy as np

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.geometry.ellipsoids import covariances_from_axes
from odeform.types import SH0, GaussianSplats

__all__ = ["read_splat"]

SPLAT_BYTES = 260  # of memory while reading
SPLAT = np.dtype([("xyz", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("rot", "u1", 4)])


def read_splat(path: Path, merge: bool) -> GaussianSplats:
    """All splats of a file, in its units and axes. Raises `InputError` where it is cut short."""
    size = path.stat().st_size
    require_memory(f"geometry {path}", f"{size // SPLAT.itemsize:,} splats", size // SPLAT.itemsize * SPLAT_BYTES)
    data = path.read_bytes()
    if len(data) % SPLAT.itemsize:
        raise InputError(f"geometry {path}: expected 32 bytes a splat, got {len(data)} bytes")
    raw = np.frombuffer(data, dtype=SPLAT)
    rgba = raw["rgba"] / np.float32(255.0)
    harmonics = ((rgba[:, None, :3] - 0.5) / SH0).astype(np.float32)
    covariances = covariances_from_axes(raw["scale"], raw["rot"] - 128.0)
    return GaussianSplats(raw["xyz"].copy(), covariances, harmonics, rgba[:, 3])
