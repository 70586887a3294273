"""The scale that turns values on surfaces into colors."""

from collections.abc import Iterable

import numpy as np
from jaxtyping import UInt8

from odeform.types import Floats, Perpoint
from odeform_viz.view import ColorScale

__all__ = ["ScaleFitter", "colors_of", "gradient_html", "histogram_of"]

# even samples of viridis, perceptually uniform, also in grayscale and for color-blind readers; its yellow is as pale as
# the tone mapping of the browser can show it
STOPS = np.array(
    [(68, 1, 84), (72, 40, 120), (62, 74, 137), (49, 104, 142), (38, 130, 142), (31, 158, 137), (53, 183, 121),
     (109, 205, 89), (180, 221, 84), (251, 231, 136)]
)  # fmt: skip
TABLE = np.stack(
    [np.interp(np.linspace(0.0, len(STOPS) - 1.0, 256), np.arange(len(STOPS)), channel) for channel in STOPS.T], axis=1
).astype(np.uint8)
UNITS = {"displacement": "mm", "strain": "%", "error": "mm"}
BINS = 32  # of the histogram
SMALLEST = 0.01  # mm or %; a scale that ends lower would show nothing that can be seen
STEPS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
KEPT = 0.5  # of the scale of a moment that has to be in use; a larger part would change it too often


class ScaleFitter:
    """Fits the scale in round steps: to a whole motion, or to each moment."""

    def __init__(self) -> None:
        self._scale: ColorScale | None = None

    def fit(self, quantity: str, largest: float, momentary: bool = True) -> ColorScale:
        """Fits a scale of `quantity` from 0 to at least `largest`, in its unit.

        That of a moment stays as it is when the values change a little.
        """
        scale = self._scale
        same = scale is not None and scale.quantity == quantity and scale.momentary and momentary
        if scale is None or not same or not KEPT * scale.top <= largest <= scale.top:
            top = _round_up(max(largest, SMALLEST))
            scale = self._scale = ColorScale(quantity, UNITS[quantity], top, momentary)
        return scale

    def fixed(self, quantity: str) -> ColorScale | None:
        """The scale that was fitted to a whole motion; None if none was, for this quantity."""
        scale = self._scale
        return scale if scale is not None and scale.quantity == quantity and not scale.momentary else None


def colors_of(values: Perpoint, scale: ColorScale) -> UInt8[np.ndarray, "points 3"]:
    """sRGB colors (N, 3) of values (N,); those above the scale have the color of its end."""
    return TABLE[np.clip(values * (255.0 / scale.top), 0.0, 255.0).astype(np.intp)]


def histogram_of(values: Iterable[Perpoint], scale: ColorScale) -> Floats:
    """Counts values along the scale, (`BINS`,), 1 for the largest; those above it are in the last bin."""
    every = np.clip(np.concatenate(list(values)), 0.0, scale.top)
    counts = np.histogram(every, BINS, (0.0, scale.top))[0]
    return counts / max(int(counts.max()), 1)


def gradient_html(histogram: Floats | None) -> str:
    """Returns the colors from 0 to the top, below a histogram (BINS,) where one is given."""
    stops = ",".join(f"rgb({r},{g},{b})" for r, g, b in STOPS.tolist())
    shares = [] if histogram is None else histogram.tolist()
    bars = "".join(
        f'<rect x="{i}" y="{1.0 - share:.2f}" width="0.9" height="{share:.2f}"/>'
        for i, share in enumerate(shares)
        if share
    )
    return (
        f'<svg viewBox="0 0 {BINS} 1" preserveAspectRatio="none" fill="currentColor" opacity="0.5">{bars}</svg>'
        f'<div style="height:9px;border-radius:3px;background:linear-gradient(to right,{stops})"></div>'
    )


def _round_up(value: float) -> float:
    """The next of a few round numbers, at most 1.5 times as large."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in STEPS if step * power >= value * (1.0 - 1e-9)))
