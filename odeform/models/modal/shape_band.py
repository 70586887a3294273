"""The error band of bodies that were not trained: from errors on other such bodies, wider the farther the shape is."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.models.error_band import ABOUT, NOMINAL, TINY
from odeform.types import Floats, Times

__all__ = [
    "SHAPE_BAND",
    "ShapeBand",
    "ShapeErrors",
    "calibrated_shape_band",
    "coverage",
    "coverages_left_out",
    "fit_shape_band",
]

SHAPE_BAND = "own_band"
"""Key of a checkpoint's configuration."""
NEAR = 0.02  # distance up to which errors grow little


@dataclass(frozen=True, eq=False)
class ShapeErrors:
    """The errors of P pushes of one shape at T frames."""

    distance: float
    sizes: Float[np.ndarray, " pushes"]
    """mm, RMS displacement of the predicted motions."""
    errors: Float[np.ndarray, "pushes times"]
    """mm, RMSE."""

    def rows(self) -> Iterator[tuple[float, Floats]]:
        """Size and errors (T,) of each push."""
        return zip((float(size) for size in self.sizes), self.errors, strict=True)


@dataclass(frozen=True)
class ShapeBand:
    """The RMSE that half, and a fraction `NOMINAL`, of motions stay within: a scale times a profile over time.

    The scale is exp(`level`) times powers of the motion's size in mm and of 1 + distance / `NEAR`.
    """

    level: float
    by_size: float
    """Power of the size."""
    by_distance: float
    """Power of 1 + distance / `NEAR`."""
    times: tuple[float, ...]
    """(T,) s."""
    profile: tuple[tuple[float, float], ...]
    """(T, 2) logarithms of the median and of the quantile `NOMINAL`."""
    shapes: int = 0
    """Of how many shapes it was calibrated, each by the others; 0 where it was fitted only."""
    covered: float = 0.0
    """The fraction of frames within the quantile `NOMINAL`, of shapes that were left out in turn; 0 where unknown."""

    def at(self, size: float, distance: float, times: Times) -> Floats:
        """Maps (T,) s to (T, 2) mm for a motion of RMS displacement `size` mm. After the window it grows with time."""
        scale = np.exp(self.level) * size**self.by_size * (1.0 + distance / NEAR) ** self.by_distance
        frames = np.concatenate([[0.0], self.times])
        columns = np.concatenate([[[0.0, 0.0]], np.exp(self.profile)])
        profile = np.stack([np.interp(times, frames, column) for column in columns.T], axis=1)
        return scale * profile * np.maximum(times / self.times[-1], 1.0)[:, None]

    def describe(self) -> str:
        """Says what it rests on, as in "as measured on 30 other shapes that were not trained"."""
        count = f"{self.shapes} " if self.shapes else ""
        held = f", where the limit for 9 of 10 cases held in {100.0 * self.covered:.0f} %" if self.covered else ""
        return f"as measured on {count}other shapes that were not trained{held}"

    def to_json(self) -> dict[str, Any]:
        """Returns plain values."""
        return asdict(self)

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> "ShapeBand":
        """The inverse of `to_json`; KeyError, TypeError or ValueError where something is missing."""
        numbers = {key: float(values[key]) for key in ("level", "by_size", "by_distance")}
        profile = tuple((float(median), float(nominal)) for median, nominal in values["profile"])
        measured = {"shapes": int(values.get("shapes", 0)), "covered": float(values.get("covered", 0.0))}
        return cls(**numbers, times=tuple(float(time) for time in values["times"]), profile=profile, **measured)


def fit_shape_band(shapes: Sequence[ShapeErrors], times: Times) -> ShapeBand:
    """The band of errors at frames `times` (T,) s. Every shape counts alike.

    The powers follow from least squares of logarithms, the profile from the quantiles of what they leave (a split
    conformal band with a fitted scale, Lei et al. 2018).
    """
    logs = np.log(np.maximum(np.concatenate([shape.errors for shape in shapes]), TINY))
    columns = [np.stack([_logs(shape), np.full(len(shape.sizes), _far(shape.distance))], axis=1) for shape in shapes]
    inputs = np.concatenate(columns)
    weights = np.concatenate([np.full(len(shape.sizes), 1.0 / len(shape.sizes)) for shape in shapes])
    level, powers = _fitted(inputs, logs.mean(axis=1), weights)
    left = logs - level - (inputs @ powers)[:, None]
    near, count = round(ABOUT * len(times)), len(times)
    profile = []
    for frame in range(count):
        part = left[:, max(frame - near, 0) : frame + near + 1]
        repeated = np.repeat(weights, part.shape[1])
        profile.append(tuple(_quantile(part.ravel(), repeated, fraction) for fraction in (0.5, NOMINAL)))
    return ShapeBand(level, float(powers[0]), float(powers[1]), tuple(float(t) for t in times), tuple(profile))


def calibrated_shape_band(shapes: Sequence[ShapeErrors], times: Times) -> ShapeBand:
    """The band of `fit_shape_band`, widened or narrowed so that `NOMINAL` of the frames of a further shape stay within.

    How far each shape's errors are from the band of all others is its score, and the factor is the quantile `NOMINAL`
    of the scores, all shapes counting alike (conformal prediction of groups by pooled distributions, Dunn et al. 2023;
    scores of models that have not seen the group, Barber et al. 2021). That is exact for many shapes. `covered`, which
    `coverages_left_out` measures, says how good it is for few.
    """
    scores = [_scores(fit_shape_band(others, times), one) for one, others in _each_and_others(shapes)]
    weights = np.concatenate([np.full(len(values), 1.0 / len(values)) for values in scores])
    factor = _quantile(np.concatenate(scores), weights, NOMINAL)
    band = fit_shape_band(shapes, times)
    # nine in ten are not fewer than half
    profile = tuple((median, max(nominal + factor, median)) for median, nominal in band.profile)
    return replace(band, profile=profile, shapes=len(shapes))


def coverages_left_out(shapes: Sequence[ShapeErrors], times: Times) -> list[float]:
    """The fraction of frames of each shape within the band that was calibrated by all others."""
    return [coverage(calibrated_shape_band(others, times), [one]) for one, others in _each_and_others(shapes)]


def _each_and_others(shapes: Sequence[ShapeErrors]) -> Iterator[tuple[ShapeErrors, list[ShapeErrors]]]:
    for index, shape in enumerate(shapes):
        yield shape, [*shapes[:index], *shapes[index + 1 :]]


def _scores(band: ShapeBand, shape: ShapeErrors) -> Floats:
    """(P T,) logarithms of errors relative to the quantile `NOMINAL` of a band."""
    times = np.array(band.times)
    bounds = np.stack([band.at(size, shape.distance, times)[:, 1] for size, _ in shape.rows()])
    return np.log(np.maximum(shape.errors, TINY) / np.maximum(bounds, TINY)).ravel()


def coverage(band: ShapeBand, shapes: Sequence[ShapeErrors]) -> float:
    """The fraction of frames at which errors are within the band's quantile `NOMINAL`; every shape counts alike."""
    times = np.array(band.times)
    inside = [
        np.mean([row <= band.at(size, shape.distance, times)[:, 1] for size, row in shape.rows()]) for shape in shapes
    ]
    return float(np.mean(inside))


def _far(distance: float) -> float:
    return float(np.log1p(distance / NEAR))


def _logs(shape: ShapeErrors) -> Floats:
    return np.log(np.maximum(shape.sizes, TINY))


def _fitted(inputs: Floats, values: Floats, weights: Floats) -> tuple[float, Floats]:
    """The level and the two powers, of which neither is negative: errors do not shrink with size or distance."""
    kept = [0, 1]
    root = np.sqrt(weights)[:, None]
    while True:
        design = np.concatenate([np.ones((len(values), 1)), inputs[:, kept]], axis=1)
        found = np.linalg.lstsq(root * design, root[:, 0] * values, rcond=None)[0]
        if (found[1:] >= 0.0).all():
            powers = np.zeros(2)
            powers[kept] = found[1:]
            return float(found[0]), powers
        kept.pop(int(found[1:].argmin()))


def _quantile(values: Floats, weights: Floats, fraction: float) -> float:
    order = np.argsort(values)
    reached = np.cumsum(weights[order]) / weights.sum()
    return float(values[order][min(int(np.searchsorted(reached, fraction)), len(values) - 1)])
