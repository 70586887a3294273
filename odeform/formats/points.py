"""Point clouds as text."""

import warnings
from pathlib import Path

import numpy as np

from odeform.budget import require_memory
from odeform.types import PointCloud

__all__ = ["read_xyz"]

BYTES_PER_BYTE = 8  # of memory while reading: a number may have one digit


def read_xyz(path: Path, merge: bool) -> PointCloud:
    """x, y and z lead each line; further columns are ignored. Points are never merged."""
    size = path.stat().st_size
    require_memory(f"geometry {path}", f"{size:,} bytes of text", BYTES_PER_BYTE * size)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # an empty file is refused with the files of too few points
        return PointCloud(np.loadtxt(path, ndmin=2)[:, [0, 1, 2]])
