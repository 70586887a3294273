"""The scale that turns values on surfaces into colors."""

import numpy as np
from jaxtyping import UInt8

from odeform.types import Perpoint
from odeform_viz.view import ColorScale

__all__ = ["ScaleFitter", "colors_of", "gradient_css"]

# even samples of viridis, without its darkest part, which would be black in the shade: perceptually uniform, also in
# grayscale and for color-blind readers
STOPS = np.array(
    [(72, 40, 120), (62, 74, 137), (49, 104, 142), (38, 130, 142), (31, 158, 137), (53, 183, 121), (109, 205, 89),
     (180, 222, 44), (253, 231, 37)]
)  # fmt: skip
TABLE = np.stack(
    [np.interp(np.linspace(0.0, len(STOPS) - 1.0, 256), np.arange(len(STOPS)), channel) for channel in STOPS.T], axis=1
).astype(np.uint8)
UNITS = {"displacement": "mm", "strain": "%", "error": "mm"}
SMALLEST = 0.01  # mm or %; a scale that ends lower would show nothing that can be seen
STEPS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
KEPT = 0.5  # of the scale that has to be in use; a larger part would change it too often


class ScaleFitter:
    """Fits the scale to what is shown, in round steps; small changes of the values leave it as it is."""

    def __init__(self) -> None:
        self._scale: ColorScale | None = None

    def fit(self, quantity: str, largest: float) -> ColorScale:
        """Fits a scale of `quantity` from 0 to at least `largest`, in its unit."""
        scale = self._scale
        if scale is None or scale.quantity != quantity or not KEPT * scale.top <= largest <= scale.top:
            scale = self._scale = ColorScale(quantity, UNITS[quantity], _round_up(max(largest, SMALLEST)))
        return scale


def colors_of(values: Perpoint, scale: ColorScale) -> UInt8[np.ndarray, "points 3"]:
    """sRGB colors (N, 3) of values (N,); those above the scale have the color of its end."""
    return TABLE[np.clip(values * (255.0 / scale.top), 0.0, 255.0).astype(np.intp)]


def gradient_css() -> str:
    """Returns the colors from 0 to the top, as a CSS gradient."""
    stops = ",".join(f"rgb({r},{g},{b})" for r, g, b in STOPS.tolist())
    return f"linear-gradient(to right,{stops})"


def _round_up(value: float) -> float:
    """The next of a few round numbers, at most 1.5 times as large."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in STEPS if step * power >= value * (1.0 - 1e-9)))
