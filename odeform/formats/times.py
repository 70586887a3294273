"""Times at which a motion is sampled, as text."""

import numpy as np

from odeform.errors import InputError
from odeform.types import Floats

__all__ = ["parse_times"]

LIMIT = 1_000_000  # frames


def parse_times(text: str) -> Floats:
    """Maps "START:STOP:STEP" in seconds to (T,), half-open like `numpy.arange`. Raises `InputError`."""
    try:
        start, stop, step = (float(part) for part in text.split(":"))
    except ValueError:
        raise InputError(f"times: expected START:STOP:STEP in seconds, got {text!r}") from None
    if not (np.isfinite([start, stop, step]).all() and step > 0.0 and 0.0 <= start < stop):
        raise InputError(f"times: expected 0 <= START < STOP and STEP > 0, got {text!r}")
    if (stop - start) / step > LIMIT:
        raise InputError(f"times: {text!r} asks for more than {LIMIT} frames")
    return np.arange(start, stop, step)
