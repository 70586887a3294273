"""Images as colors of a surface."""

import numpy as np
from jaxtyping import Float, Int, UInt8

from odeform.types import Floats, Ints

__all__ = ["CLAMP", "MIRROR", "REPEAT", "sampled"]

REPEAT, CLAMP, MIRROR = "repeat", "clamp", "mirror"


def sampled(
    pixels: UInt8[np.ndarray, "height width 3"],
    uv: Float[np.ndarray, "vertices 2"],
    wraps: tuple[str, str] = (REPEAT, REPEAT),
) -> Float[np.ndarray, "vertices 3"]:
    """Returns sRGB colors, 0 to 255, of an image (H, W, 3) at coordinates (N, 2): 0 at its lower left, 1 at its upper
    right.

    Colors are interpolated between the four nearest pixels. Beyond 0 and 1 the image is repeated, mirrored or held, in
    each direction as `wraps` says. Coordinates that are not finite count as 0.
    """
    uv = np.where(np.isfinite(uv), uv, 0.0)
    u, v = _wrapped(uv[:, 0], wraps[0]), _wrapped(uv[:, 1], wraps[1])
    left, right, across = _between(u, pixels.shape[1])
    low, high, along = _between(1.0 - v, pixels.shape[0])
    across, along = across[:, None], along[:, None]
    flat, low, high = pixels.reshape(-1, 3), low * pixels.shape[1], high * pixels.shape[1]
    first = (1.0 - across) * flat[low + left] + across * flat[low + right]
    second = (1.0 - across) * flat[high + left] + across * flat[high + right]
    return np.round((1.0 - along) * first + along * second)


def _wrapped(values: Floats, how: str) -> Floats:
    if how == CLAMP:
        return np.clip(values, 0.0, 1.0)
    if how == MIRROR:
        return 1.0 - np.abs(values % 2.0 - 1.0)
    whole = values % 1.0
    # the far edge is the last pixel, not the first again
    return np.where((whole == 0.0) & (values > 0.0), 1.0, whole)


def _between(values: Floats, size: int) -> tuple[Int[np.ndarray, " vertices"], Ints, Floats]:
    """The two nearest pixels of `size`, and the weight of the second."""
    place = values * (size - 1)
    below = np.clip(np.floor(place).astype(np.int64), 0, size - 1)
    return below, np.minimum(below + 1, size - 1), place - below
