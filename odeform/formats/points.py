"""Point clouds as text."""

from pathlib import Path

import numpy as np

from odeform.types import PointCloud

__all__ = ["read_xyz"]


def read_xyz(path: Path, merge: bool) -> PointCloud:
    """x, y and z lead each line; further columns are ignored. Points are never merged."""
    return PointCloud(np.loadtxt(path, ndmin=2)[:, [0, 1, 2]])
