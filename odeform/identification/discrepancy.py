"""How wrong a model is, as far as it matters to parameters that are inferred from it.

A model's error is no noise: it is alike from frame to frame, so that a hundred frames may tell as little as three. It
is measured on the validation split, at parameters that are known there. What of it follows from the parameters, as a
linear function of them, is taken off; the rest is told as a variance of each cause in each frame, as large as errors
independent of each other would have to be in order to mislead as much (Kennedy & O'Hagan 2001, on calibration with
model discrepancy; composite likelihoods: Varin, Reid & Firth 2011).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.identification.linear import Comparison, Linear
from odeform.identification.observation import View, observe
from odeform.models.base import Predictor
from odeform.motion.reduced_space import POSE
from odeform.types import Floats, Ints, Times

__all__ = ["NOMINAL", "TWO_SIDED", "Discrepancy", "calibrate"]

NOMINAL, TWO_SIDED = 0.9, 1.6449
"""The share of truths that intervals are to hold, and how many standard deviations of a normal law that takes."""
FLOOR_MM = 2e-3  # what rounding of the data leaves in a cause
FIRST_SPAN = 0.025  # s; each span of time is twice as long as all before it
DISCOUNT = 2.0
"""Power of how much more than independent errors those of a span mislead. By 1 each span alone would be right; but
spans mislead alike, the late ones most. Of powers 1 and 2, the second takes a quarter off
the errors of kicks on validation."""
LEAST = 8  # sequences
RIDGE = 1.0  # on the slopes of what follows from the parameters, in sequences


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """`variances` (T, 6 + K) mm^2 of the causes at `times` (T,) seconds, and their `means` (T, 6 + K, 1 + P) mm: as
    they are in the middle of the trained ranges, and what half of each range adds."""

    times: Times
    variances: Float[np.ndarray, "times causes"]
    means: Float[np.ndarray, "times causes terms"]

    def at(self, times: Times) -> Floats:
        """Variances (T, 6 + K) mm^2 at any (T,) seconds; after the last one as there."""
        return np.exp(_between(times, self.times, np.log(self.variances)))

    def less_mean(self, linear: Linear, theta: Floats, times: Times) -> Linear:
        """A comparison at theta (P,), less what is expected of the model's error there."""
        means = _between(times, self.times, self.means)
        expected = linear.spread @ (means @ np.concatenate([[1.0], theta]))[..., None]
        slopes = means[..., 1 : 1 + linear.gain.shape[-1]]  # none where a comparison has none
        return replace(linear, off=linear.off - expected[..., 0], gain=linear.gain + slopes)


def _between(asked: Floats, times: Floats, values: Floats) -> Floats:
    """Values (T, ...) at (T,) `times`, linear between them: (A, ...) at the (A,) moments `asked`."""
    flat = values.reshape(len(times), -1)
    columns = [np.interp(asked, times, column) for column in flat.T]
    return np.stack(columns, axis=1).reshape(len(asked), *values.shape[1:])


@dataclass(frozen=True, eq=False)
class _Known:
    """Errors (S, T, 6 + K) mm and gains (S, T, 6 + K, P) of sequences whose parameters are known."""

    errors: Floats
    gains: Floats

    def part(self, rows: slice) -> "_Known":
        return _Known(self.errors[rows], self.gains[rows])


def calibrate(
    predictor: Predictor, dataset: Dataset, split: str = "val", progress: Callable[[float], None] = lambda _: None
) -> Discrepancy:
    """From a split that the model was not trained on; never the one that is then scored. Seconds to half a minute.

    `progress` is told the share that is done.
    """
    entries = dataset.select(split)
    if len(entries) < LEAST:
        raise InputError(f"split {split}: expected at least {LEAST} sequences to calibrate on, got {len(entries)}")
    errors, gains, thetas, times = [], [], [], np.zeros(0)
    for index, entry in enumerate(entries):
        sequence = dataset.read(entry)
        observation = observe(sequence, predictor.schema, View()).thinned()
        thetas.append(predictor.schema.vector(sequence.parameters))
        linear = Comparison(predictor, observation).at(thetas[-1])
        normal = linear.spread.swapaxes(1, 2) @ linear.spread
        pulled = linear.spread.swapaxes(1, 2) @ linear.off[..., None]
        errors.append(np.linalg.solve(normal, pulled)[..., 0])
        gains.append(linear.gain)
        times = observation.times  # the frames of the window, for all
        progress((index + 1) / len(entries))
    means, rest = _expected(np.array(errors), np.array(thetas))
    known = _Known(rest, np.array(gains) + means[..., 1:])
    table = _variances(known, times)
    # half of them say how far intervals from the other half are off
    halves = [slice(0, None, 2), slice(1, None, 2)]
    scores = [_scores(known.part(there), _variances(known.part(here), times)) for here, there in (halves, halves[::-1])]
    scale = np.quantile(np.abs(np.concatenate(scores)), NOMINAL) / TWO_SIDED
    return Discrepancy(times, table * max(float(scale), 1.0) ** 2, means)


def _expected(errors: Floats, thetas: Floats) -> tuple[Floats, Floats]:
    """What follows of errors (S, T, 6 + K) from theta (S, P), as (T, 6 + K, 1 + P), and what is then left of each
    sequence by means of all the others."""
    terms = np.concatenate([np.ones((len(thetas), 1)), thetas], axis=1)
    ridge = RIDGE * np.diag([0.0] + [1.0] * thetas.shape[1])
    solved = np.linalg.solve(terms.T @ terms + ridge, terms.T)
    means = np.einsum("ps,stc->tcp", solved, errors)
    own = np.einsum("sp,ps->s", terms, solved)  # the weight that each has in its own mean
    return means, (errors - np.einsum("tcp,sp->stc", means, terms)) / (1.0 - own)[:, None, None]


def _spans(times: Times) -> Ints:
    """(T,) the number of the span of time that each moment is in."""
    return np.floor(np.log2(np.maximum(times / FIRST_SPAN, 1.0) + 1e-9)).astype(int)


def _variances(known: _Known, times: Times) -> Floats:
    """(T, 6 + K): mean squares, each span and kind of causes as much larger as its errors mislead."""
    plain = (known.errors**2).mean(axis=0) + FLOOR_MM**2
    table, spans, kinds = plain.copy(), _spans(times), np.arange(plain.shape[1]) >= POSE
    for span in np.unique(spans):
        for kind in np.unique(kinds):
            block = np.nonzero(spans == span)[0][:, None], np.nonzero(kinds == kind)[0]
            table[block] *= max(_misled(known, plain, block), 1.0) ** DISCOUNT
    return table


def _weighed(known: _Known, variances: Floats, block: tuple[Ints, Ints]) -> tuple[Floats, Floats]:
    """Information (S, P, P) and score (S, P) in a block of frames and causes."""
    frames, causes = block
    deviations = np.sqrt(variances[block])
    count, parameters = len(known.errors), known.gains.shape[-1]
    gains = (known.gains[:, frames, causes] / deviations[..., None]).reshape(count, -1, parameters)
    errors = (known.errors[:, frames, causes] / deviations).reshape(count, -1)
    return gains.swapaxes(1, 2) @ gains, np.einsum("snp,sn->sp", gains, errors)


def _misled(known: _Known, variances: Floats, block: tuple[Ints, Ints]) -> float:
    """Mean square, in standard deviations, by which the errors of a block mislead; 1 for independent ones."""
    information, score = _weighed(known, variances, block)
    values, vectors = np.linalg.eigh(information)
    along = np.einsum("spq,sp->sq", vectors, score) ** 2
    told = values > 1e-6 * values.max(axis=1, keepdims=True) + 1e-12
    return float((along[told] / values[told]).mean()) if told.any() else 1.0


def _scores(known: _Known, variances: Floats) -> Floats:
    """(S, P) errors of the parameters, in the standard deviations that `variances` gives them."""
    frames, causes = (np.arange(size) for size in variances.shape)
    information, score = _weighed(known, variances, (frames[:, None], causes))
    covariance = np.linalg.pinv(information, hermitian=True)
    deviations = np.sqrt(np.einsum("spp->sp", covariance))
    return np.einsum("spq,sq->sp", covariance, score) / np.maximum(deviations, 1e-12)
