"""How far what a figure shows is from its model: measured at random parameters and random times."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.figure.body import FigureBody
from odeform.figure.sampling import Source
from odeform.figure.table import cubic_weights
from odeform.types import Floats, Times

__all__ = ["FigureError", "Probes", "between", "draw_probes"]

DRAWS, MOMENTS = 48, 48  # parameter sets, and times of each

Moments = Float[np.ndarray, " moments"]


@dataclass(frozen=True)
class FigureError:
    """RMS distance of the points in mm, at random times of random motions."""

    rms: float
    """Of all motions together."""
    half: float
    """That half of the motions stay within."""
    most: float
    """That 90 % of the motions stay within."""
    worst: float
    """Of the worst motion."""

    def relative(self, tolerance: tuple[float, float]) -> float:
        """How much `half` and `most` are of what they may be, in mm; the larger one."""
        return max(self.half / tolerance[0], self.most / tolerance[1])


@dataclass(frozen=True, eq=False)
class Probes:
    """Motions of the model itself, to compare with."""

    places: Float[np.ndarray, "sets sweeps"]
    """On the sliders, from 0 to 1."""
    moments: Moments
    """Seconds, in order."""
    points: list[Float[np.ndarray, "moments points 3"]]
    """Of each place, in metres."""
    body: FigureBody
    """With these points."""

    def error(self, motions: Iterable[Floats], times: Times) -> FigureError:
        """The error of coordinates y (T, D) at `times` (T,) s, of each place."""
        squares = []
        for y, points in zip(motions, self.points, strict=True):
            shown = self.body.points(between(y, times, self.moments))
            squares.append(np.square(shown - points, dtype=float).sum(axis=-1).mean())
        each = 1e3 * np.sqrt(squares)
        half, most = np.quantile(each, [0.5, 0.9])
        return FigureError(1e3 * math.sqrt(np.mean(squares)), float(half), float(most), float(each.max()))


def draw_probes(source: Source, body: FigureBody, times: Times) -> Probes:
    """Draws places on the sliders and moments within `times` (T,) s, always the same, and solves the motions.

    `body` is that of the source, with the splats that are shown: errors are those of some of them.
    """
    rng = np.random.default_rng(0)
    places = rng.random((DRAWS if source.sweeps else 1, len(source.sweeps)))
    moments = np.sort(rng.uniform(times[0], times[-1], MOMENTS))
    measured, kept = body.sampled()
    return Probes(places, moments, source.vertices(places, moments, kept), measured)


def between(
    y: Float[np.ndarray, "times coordinates"], times: Times, moments: Moments
) -> Float[np.ndarray, "moments coordinates"]:
    """Interpolates y (T, D) at even `times` (T,) s to (M, D) at `moments` (M,) s."""
    frames = (np.clip(moments, times[0], times[-1]) - times[0]) / (times[1] - times[0])
    return np.stack([cubic_weights(frame, len(times)) for frame in frames]) @ y
