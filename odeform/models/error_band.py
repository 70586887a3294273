"""How wrong a model is likely to be: an error band from its errors on sequences that it was not trained on."""

import numpy as np
from jaxtyping import Float

from odeform.models.conformal import SCORES, conformal_factor
from odeform.models.continuation import LATER_ERRORS
from odeform.types import Arrays, Floats, Times

__all__ = ["FEWEST", "OUTSIDE", "SIZES", "STRONGER", "ErrorBand", "error_band", "excess_of"]

NOMINAL = 0.9
FEWEST = 8
"""Validation sequences from which on a band is shown: the 90 % quantile of fewer is that of the worst one."""
WIDTHS = (0.2, 0.35, 0.6, 1.0, 2.0)
"""Candidates for the distance in normalised parameters over which errors are similar."""
TINY = 1e-6  # mm
OUTSIDE = "val.outside"
"""(2, P): by how much the logarithm of errors grows, per half trained range below and above it."""
STRONGER = "val.stronger"
"""(): by how much it grows where a push is stronger than all in training, per half of the strongest of these."""
SIZES = "val.size_mm"
"""(S,) mm: RMS displacement, over the times of the errors, of the motion that the model predicts of each sequence."""
BETTER = 0.9
"""Of the mean square that is left of the scale: a band follows the size of motions if less is left then."""
FARTHEST = 10.0  # doublings outside the trained range, at which the band stops widening
ABOUT = 0.05  # fraction of the frames, on either side, that scale and quantiles of a frame are taken over


def error_band(arrays: Arrays) -> "ErrorBand | None":
    """Returns the band of a checkpoint's arrays; None without validation errors, or with those of too few sequences."""
    enough = "val.theta" in arrays and len(arrays["val.theta"]) >= FEWEST
    return ErrorBand(arrays) if enough else None


class ErrorBand:
    """The RMSE over time that half, and a fraction `NOMINAL`, of unseen motions with given parameters stay within.

    A split conformal band (Lei et al. 2018) of locally scaled residuals: the errors of the validation sequences are the
    product of a profile over time, a scale that is smooth over parameters and time, and a residual, whose quantiles
    around each time make the band; the scale of a sequence is estimated from the others alone. Where that predicts the
    scale better, it is a power of the size of the predicted motion besides (`SIZES`): what hardly moves is hardly
    wrong. Outside of the trained ranges it grows as errors on simulations there did (`OUTSIDE`, `STRONGER`); without,
    it doubles with each `width`. Beyond the window it grows in proportion to the time, or as the errors of the
    continuation did when it predicted the last third of the window, if that is more; after as long as that, with the
    square of the time that they were predicted for. Where a checkpoint has scores of whole motions
    (`odeform.models.conformal`), the upper quantile is widened or narrowed so that `NOMINAL` of them stay within it at
    all times.
    """

    def __init__(self, arrays: Arrays) -> None:
        """Reads `val.theta` (S, P) in [-1, 1], `val.times` (T,) s and `val.rmse_mm` (S, T); KeyError without them. A
        continuation adds `val.later_mm` (S, L): errors 1 to L frames after the last that it was given."""
        self._growth, self._stronger = arrays.get(OUTSIDE), arrays.get(STRONGER)
        scores = arrays.get(SCORES, np.zeros(0)).astype(float)
        factor = conformal_factor(scores, NOMINAL)
        self._whole = factor or 1.0
        self.motions = 0 if factor is None else len(scores)
        """Of how many whole motions the band was calibrated; 0 where it holds for single moments."""
        self._theta = arrays["val.theta"].astype(float)
        self._times = arrays["val.times"].astype(float)
        logs = np.log(np.maximum(arrays["val.rmse_mm"][:, 1:].astype(float), TINY))
        profile = np.median(logs, axis=0)
        self._by_size, self._smallest = 0.0, TINY
        left = self._fit_scale(logs - profile, arrays.get(SIZES))
        quantiles = np.array([np.quantile(part, [0.5, NOMINAL]) for part in _around(left)])
        self._profile = np.concatenate([np.full((1, 2), np.log(TINY)), profile[:, None] + quantiles])
        later = arrays.get(LATER_ERRORS, np.zeros((1, 1)))
        self._later = np.maximum.accumulate(np.quantile(later, [0.5, NOMINAL], axis=0).T)

    @property
    def follows_size(self) -> bool:
        """Whether it depends on the size of the predicted motion."""
        return self._by_size > 0.0

    def _fit_scale(self, logs: Floats, sizes: Floats | None) -> Floats:
        """Chooses how the scale follows parameters, time and size, from the logarithms (S, T) of errors over their
        profile; returns what it leaves (S, T) of them."""
        self._levels = np.stack([part.mean(axis=1) for part in _around(logs)], axis=1)
        self._width, left = self._best_width(logs)
        if sizes is None:
            return left
        moved = np.log(np.maximum(sizes.astype(float), TINY))
        away = moved - moved.mean()
        power, without = float(away @ logs.mean(axis=1)) / max(float(away @ away), TINY), self._levels
        self._levels = without - power * moved[:, None]
        width, less = self._best_width(logs - power * moved[:, None])
        if power > 0.0 and _unexplained(less) < BETTER * _unexplained(left):
            self._by_size, self._smallest, self._width = power, float(np.exp(moved.min())), width
            return less
        self._levels = without
        return left

    def _best_width(self, logs: Floats) -> tuple[float, Floats]:
        """The width by which the others predict each sequence best, and what they leave (S, T) of its logarithms."""
        left = {width: logs - self._smooth(self._theta, width, leave_out=True) for width in WIDTHS}
        width = min(WIDTHS, key=lambda width: float((left[width] ** 2).mean()))
        return width, left[width]

    def _smooth(self, theta: Floats, width: float, leave_out: bool = False) -> Floats:
        """(M, P) -> (M, T) the log scale there, a kernel mean over the validation sequences."""
        squares = ((theta[:, None] - self._theta) ** 2).sum(axis=2) / (2.0 * width**2)
        if leave_out:
            np.fill_diagonal(squares, np.inf)
        weights = np.exp(squares.min(axis=1, keepdims=True) - squares)
        return (weights @ self._levels) / weights.sum(axis=1, keepdims=True)

    def _outside(self, theta: Floats, stronger: float) -> float:
        excess, doubling = excess_of(theta), np.log(2.0) / self._width
        grown = doubling * np.linalg.norm(excess) if self._growth is None else (excess * self._growth).sum()
        grown += min(stronger, 1e3) * (doubling if self._stronger is None else self._stronger)
        return min(float(grown), np.log(2.0) * FARTHEST)

    def at(self, theta: Floats, times: Times, stronger: float = 0.0, size: float = 0.0) -> Floats:
        """Maps (P,) parameters in [-1, 1] and (T,) seconds to (T, 2) mm: the median, and the quantile `NOMINAL`.

        `stronger` is `odeform.surroundings.Contacts.stronger` of a push, and `size` the RMS displacement in mm of the
        predicted motion, for a band that follows it (`follows_size`).
        """
        there = self._smooth(np.clip(theta, -1.0, 1.0)[None], self._width)[0]
        bounds = self._profile + np.concatenate([there[:1], there])[:, None]
        level = self._outside(theta, stronger) + self._by_size * np.log(max(size, self._smallest))
        stop = self._times[-1]
        profile = np.stack([np.interp(times, self._times, column) for column in bounds.T], axis=1)
        grown = np.maximum(times / stop, 1.0)[:, None] * np.exp(profile + level)
        frames = (times - stop) / (self._times[1] - self._times[0])
        leads = np.arange(len(self._later) + 1.0)
        later = np.stack(
            [np.interp(frames, leads, np.concatenate([[0.0], column])) for column in self._later.T], axis=1
        )
        later *= (np.maximum(frames / leads[-1], 1.0) ** 2)[:, None]
        band = np.where(times[:, None] > 0.0, np.maximum(grown, later), 0.0)
        # nine in ten are not fewer than half
        return np.stack([band[:, 0], np.maximum(self._whole * band[:, 1], band[:, 0])], axis=1)


def _around(rows: Floats) -> list[Floats]:
    """T of (S, N): the entries of (S, T) around each time."""
    count = rows.shape[1]
    near = round(ABOUT * count)
    return [rows[:, max(index - near, 0) : index + near + 1] for index in range(count)]


def _unexplained(left: Floats) -> float:
    """Mean square of what is left of the scale of whole sequences."""
    return float((left.mean(axis=1) ** 2).mean())


def excess_of(theta: Float[np.ndarray, "*batch parameters"]) -> Float[np.ndarray, "*batch 2 parameters"]:
    """(..., P) -> (..., 2, P): how far parameters are below -1, and above 1; at most 1,000."""
    return np.clip(np.stack([-1.0 - theta, theta - 1.0], axis=-2), 0.0, 1e3)
