"""Colors with gamma and without."""

import numpy as np
from jaxtyping import UInt8

from odeform.types import Floats

__all__ = ["to_linear", "to_srgb"]


def to_linear(srgb: Floats) -> Floats:
    """Maps (...) sRGB values from 0 to 1 to linear ones (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: Floats) -> UInt8[np.ndarray, "vertices 3"]:
    """Maps (N, 3) linear values from 0 to 1 to sRGB ones from 0 to 255."""
    linear = np.clip(np.nan_to_num(linear), 0.0, 1.0)
    return np.round(255.0 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)).astype(
        np.uint8
    )
