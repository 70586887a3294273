"""Point clouds as text."""

import warnings
from pathlib import Path

import numpy as np

from odeform.types import PointCloud

__all__ = ["read_xyz"]


def read_xyz(path: Path, merge: bool) -> PointCloud:
    """x, y and z lead each line; further columns are ignored. Points are never merged."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # an empty file is refused with the files of too few points
        return PointCloud(np.loadtxt(path, ndmin=2)[:, [0, 1, 2]])
