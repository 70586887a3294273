"""Errors of a predicted motion against a recorded one."""

import math

import numpy as np

from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.types import Floats, Times

__all__ = ["DISTANCE", "truth_errors"]

DISTANCE = math.sqrt(3.0)  # RMS of distances, in RMS of their three coordinates


def truth_errors(motion: Motion, truth: RecordedMotion, times: Times) -> Floats:
    """Computes (T, 3) mm at (T,) s: RMSE and MAE over all coordinates, and the largest distance of a vertex.

    NaN after the end of the record. `motion` must move the mesh of `truth`, vertex by vertex.
    """
    out = np.full((len(times), 3), np.nan)
    for row, time in zip(out, times, strict=True):
        if not truth.extrapolates(float(time)):
            off = np.subtract(motion.vertices(float(time)), truth.vertices(float(time)), dtype=float)
            worst = np.linalg.norm(off, axis=1).max()
            row[:] = 1e3 * np.array([np.sqrt((off**2).mean()), np.abs(off).mean(), worst])
    return out
