"""Model discrepancy: the error of a model as it affects parameters that are estimated from it.

Model error is correlated from frame to frame, so a hundred frames may carry as little information as three. It is
measured on the validation split, where the parameters are residuals. The part that is linear in the parameters is
subtracted. The rest is described by a variance of each cause in each frame, as large as independent errors would have
to be to bias the estimates as much (calibration with model discrepancy: Kennedy & O'Hagan 2001; composite likelihoods:
Varin, Reid & Firth 2011).
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
from odeform.types import Arrays, Floats, Ints, Times

__all__ = ["LEAST", "NOMINAL", "PREFIX", "TWO_SIDED", "Discrepancy", "calibrate", "stored_discrepancy"]

NOMINAL, TWO_SIDED = 0.9, 1.6449
"""Nominal coverage of the intervals, and the matching number of standard deviations of a normal distribution."""
PREFIX = "discrepancy."
"""Prefixes the names of its arrays in a checkpoint."""
FLOOR_MM = 2e-3  # error of a cause from rounding of the data
FIRST_SPAN = 0.025  # s; each span of time is twice as long as all before it
DISCOUNT = 2.0
"""Power of the ratio by which the errors of a span bias more than independent ones. A power of 1 would be right for a
single span, but spans are correlated, late ones most. On validation, a power of 2 reduces the errors of kicks by a
quarter against a power of 1."""
LEAST = 8
"""Sequences to calibrate on."""
RIDGE = 1.0  # on the slopes of the linear part, in sequences


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """`variances` (T, 6 + K) mm^2 of the causes at `times` (T,) s, and their `means` (T, 6 + K, 1 + P) mm: the value in
    the middle of the trained ranges, and the change over half of each range."""

    times: Times
    variances: Float[np.ndarray, "times causes"]
    means: Float[np.ndarray, "times causes terms"]

    def arrays(self) -> Arrays:
        """The float32 arrays of a checkpoint, by name; `stored_discrepancy` reads them."""
        named = {"times": self.times, "variances": self.variances, "means": self.means}
        return {PREFIX + name: value.astype(np.float32) for name, value in named.items()}

    def at(self, times: Times) -> Floats:
        """Returns the variances (T, 6 + K) mm^2 at `times` (T,) s; constant after the last one."""
        return np.exp(_between(times, self.times, np.log(self.variances)))

    def minus_mean(self, linear: Linear, theta: Floats, times: Times) -> Linear:
        """Returns a comparison at theta (P,), minus the expected error of the model there."""
        means = _between(times, self.times, self.means)
        expected = linear.spread @ (means @ np.concatenate([[1.0], theta]))[..., None]
        slopes = means[..., 1 : 1 + linear.jacobian.shape[-1]]  # empty if the comparison has no jacobians
        return replace(linear, residual=linear.residual - expected[..., 0], jacobian=linear.jacobian + slopes)


def stored_discrepancy(predictor: Predictor) -> Discrepancy | None:
    """Reads the discrepancy of a predictor's checkpoint; None where it has none. `InputError` for a damaged one."""
    arrays = predictor.checkpoint.arrays
    if f"{PREFIX}times" not in arrays:
        return None
    times, variances, means = (arrays[PREFIX + name].astype(float) for name in ("times", "variances", "means"))
    terms = 1 + len(predictor.schema.learned)
    sound = times.ndim == 1 and variances.shape[:1] == times.shape and means.shape == (*variances.shape, terms)
    if not (sound and all(np.isfinite(x).all() for x in (times, variances, means)) and (variances > 0.0).all()):
        raise InputError("checkpoint: its calibration of `identify` is damaged")
    return Discrepancy(times, variances, means)


def _between(queries: Floats, times: Floats, values: Floats) -> Floats:
    """Linear interpolation of `values` (T, ...) at `times` (T,), to (A, ...) at `queries` (A,)."""
    flat = values.reshape(len(times), -1)
    columns = [np.interp(queries, times, column) for column in flat.T]
    return np.stack(columns, axis=1).reshape(len(queries), *values.shape[1:])


@dataclass(frozen=True, eq=False)
class _Residuals:
    """Errors (S, T, 6 + K) mm and jacobians (S, T, 6 + K, P) of sequences whose parameters are residuals."""

    errors: Floats
    jacobians: Floats

    def part(self, rows: slice) -> "_Residuals":
        return _Residuals(self.errors[rows], self.jacobians[rows])


def calibrate(
    predictor: Predictor, dataset: Dataset, split: str = "val", progress: Callable[[float], None] = lambda _: None
) -> Discrepancy:
    """Measure a model's own error on recorded motions, for `identify`. Takes seconds to half a minute.

    Args:
        predictor: A model in reduced coordinates (`odeform`, `pod-rbf` or `nearest`).
        dataset: Motions of its scene with known parameters.
        split: Sequences that the model was not trained on, and that are not scored afterwards.
        progress: Called with the fraction that is done.

    Returns:
        Means and variances of the error over time, in millimetres.

    Raises:
        InputError: Too few sequences, or a model of another kind.

    Examples:
        >>> import dataclasses, odeform
        >>> dataset = odeform.open_dataset("mass-elastic")
        >>> few = dataclasses.replace(dataset, entries=dataset.entries[::4])
        >>> discrepancy = odeform.calibrate(odeform.load("mass-elastic"), few)
        >>> discrepancy.times.shape  # the trained frames after the first
        (150,)
    """
    entries = dataset.select(split)
    if len(entries) < LEAST:
        raise InputError(f"split {split}: expected at least {LEAST} sequences to calibrate on, got {len(entries)}")
    errors, jacobians, thetas, times = [], [], [], np.zeros(0)
    for index, entry in enumerate(entries):
        sequence = dataset.read(entry)
        observation = observe(sequence, predictor.schema, View()).subsampled()
        thetas.append(predictor.schema.vector(sequence.parameters))
        linear = Comparison(predictor, observation).at(thetas[-1])
        normal = linear.spread.swapaxes(1, 2) @ linear.spread
        pulled = linear.spread.swapaxes(1, 2) @ linear.residual[..., None]
        errors.append(np.linalg.solve(normal, pulled)[..., 0])
        jacobians.append(linear.jacobian)
        times = observation.times  # the frames of the window, the same for all
        progress((index + 1) / len(entries))
    means, rest = _linear_part(np.array(errors), np.array(thetas))
    residuals = _Residuals(rest, np.array(jacobians) + means[..., 1:])
    table = _variances(residuals, times)
    # cross-validation: each half scores the intervals of the other
    halves = [slice(0, None, 2), slice(1, None, 2)]
    scores = [
        _scores(residuals.part(there), _variances(residuals.part(here), times))
        for here, there in (halves, halves[::-1])
    ]
    scale = np.quantile(np.abs(np.concatenate(scores)), NOMINAL) / TWO_SIDED
    return Discrepancy(times, table * max(float(scale), 1.0) ** 2, means)


def _linear_part(errors: Floats, thetas: Floats) -> tuple[Floats, Floats]:
    """Linear part of errors (S, T, 6 + K) in theta (S, P), as (T, 6 + K, 1 + P), and the leave-one-out residuals."""
    terms = np.concatenate([np.ones((len(thetas), 1)), thetas], axis=1)
    ridge = RIDGE * np.diag([0.0] + [1.0] * thetas.shape[1])
    solved = np.linalg.solve(terms.T @ terms + ridge, terms.T)
    means = np.einsum("ps,stc->tcp", solved, errors)
    leverage = np.einsum("sp,ps->s", terms, solved)  # the weight that each has in its own mean
    return means, (errors - np.einsum("tcp,sp->stc", means, terms)) / (1.0 - leverage)[:, None, None]


def _spans(times: Times) -> Ints:
    """(T,) index of the time span that each frame is in."""
    return np.floor(np.log2(np.maximum(times / FIRST_SPAN, 1.0) + 1e-9)).astype(int)


def _variances(residuals: _Residuals, times: Times) -> Floats:
    """(T, 6 + K) mm^2: mean squares, inflated in each span and kind of causes by how much its errors bias."""
    plain = (residuals.errors**2).mean(axis=0) + FLOOR_MM**2
    table, spans, kinds = plain.copy(), _spans(times), np.arange(plain.shape[1]) >= POSE
    for span in np.unique(spans):
        for kind in np.unique(kinds):
            block = np.nonzero(spans == span)[0][:, None], np.nonzero(kinds == kind)[0]
            table[block] *= max(_inflation(residuals, plain, block), 1.0) ** DISCOUNT
    return table


def _weighted(residuals: _Residuals, variances: Floats, block: tuple[Ints, Ints]) -> tuple[Floats, Floats]:
    """Fisher information (S, P, P) and score (S, P) of a block of frames and causes."""
    frames, causes = block
    deviations = np.sqrt(variances[block])
    count, parameters = len(residuals.errors), residuals.jacobians.shape[-1]
    jacobians = (residuals.jacobians[:, frames, causes] / deviations[..., None]).reshape(count, -1, parameters)
    errors = (residuals.errors[:, frames, causes] / deviations).reshape(count, -1)
    return jacobians.swapaxes(1, 2) @ jacobians, np.einsum("snp,sn->sp", jacobians, errors)


def _inflation(residuals: _Residuals, variances: Floats, block: tuple[Ints, Ints]) -> float:
    """Mean squared bias of the estimates from a block, in standard deviations; 1 for independent errors."""
    information, score = _weighted(residuals, variances, block)
    values, vectors = np.linalg.eigh(information)
    along = np.einsum("spq,sp->sq", vectors, score) ** 2
    informative = values > 1e-6 * values.max(axis=1, keepdims=True) + 1e-12
    return float((along[informative] / values[informative]).mean()) if informative.any() else 1.0


def _scores(residuals: _Residuals, variances: Floats) -> Floats:
    """(S, P) errors of the estimates, in the standard deviations that follow from `variances`."""
    frames, causes = (np.arange(size) for size in variances.shape)
    information, score = _weighted(residuals, variances, (frames[:, None], causes))
    covariance = np.linalg.pinv(information, hermitian=True)
    deviations = np.sqrt(np.einsum("spp->sp", covariance))
    return np.einsum("spq,sq->sp", covariance, score) / np.maximum(deviations, 1e-12)
