"""Frames at other times than they were recorded, by cubic splines."""

import numpy as np
from scipy.interpolate import CubicSpline

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.types import Floats

__all__ = ["UNEVEN", "even_times", "is_even", "resampled"]

SHORTEST = 1e-9  # step between frames, relative to the whole
UNEVEN = 1e-3  # of a step: more, and frames are resampled


def is_even(times: Floats, step: float) -> bool:
    """Whether (T,) times are `step` apart."""
    return bool(np.abs(times - times[0] - step * np.arange(len(times))).max() <= UNEVEN * step)


def even_times(times: Floats, where: str) -> Floats:
    """(T,) seconds from 0, as many in the same time, evenly spaced. Raises `InputError`, which `where` leads, for times
    that do not increase."""
    if len(times) < 2 or not np.isfinite(times).all():
        raise InputError(f"{where}: expected at least 2 frames at finite times, got {len(times)}")
    steps = np.diff(times)
    if steps.min() <= 0.0 or steps.min() < SHORTEST * (times[-1] - times[0]):
        raise InputError(f"{where}: expected times that increase by at least {SHORTEST:g} of the whole in each frame")
    return np.linspace(0.0, float(times[-1] - times[0]), len(times))


def resampled(times: Floats, frames: Floats, wanted: Floats, where: str) -> Floats:
    """Returns the frames (T, N, 3) of `times` (T,), both from their first, at the times `wanted` (K,), as (K, N, 3)."""
    size = 8.0 * frames[0].size * (8 * len(times) + 2 * len(wanted))
    require_memory(where, f"{len(wanted)} frames between {len(times)}", size)
    return CubicSpline(times - times[0], frames)(wanted)
