"""Kernel ridge regression (Matern), and the search for its length scales, its ridge and the order of its kernel."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve, get_lapack_funcs
from scipy.optimize import minimize

from odeform.models.matern import matern
from odeform.types import Floats

__all__ = ["ORDERS", "Ridge", "search_ridge"]

ORDERS = (2, 6)
"""Of the kernels to choose from: contacts make motions rough in the parameters, without them they are smooth."""

STARTS = (0.5, 2.0, 8.0)  # length scales that the search starts from; the trained range is 2 long
RIDGE = 1e-6  # where it starts, relative to the kernel's value at distance 0
SMOOTHER = 0.85  # share of the error of the first order that another may have at most: a rough kernel risks less
EVALUATIONS = 150  # of the error, from each start
BOUNDS = ((np.log(0.05), np.log(200.0)), (np.log(1e-12), 0.0))  # of length scales and ridge, in logarithms

Parameters = Float[np.ndarray, "sequences parameters"]


@dataclass(frozen=True, eq=False)
class Ridge:
    """The settings of a kernel ridge regression, and the `error` that they were chosen by."""

    scales: Float[np.ndarray, " parameters"]
    """Length scales, in units of the normalised parameters."""
    ridge: float
    """Relative to the kernel's value at distance 0."""
    order: int = ORDERS[0]
    """Of the Matern kernel."""
    error: float = float("inf")

    def weights(self, theta: Parameters, outputs: Float[np.ndarray, "sequences outputs"]) -> Floats:
        """(S, outputs): what training outputs at `theta` (S, P) weigh in a prediction."""
        return cho_solve(self._factor(theta), outputs)

    def predict(self, asked: Floats, theta: Parameters, outputs: Floats) -> Float[np.ndarray, "asked outputs"]:
        """Predictions at `asked` (A, P) from outputs at `theta` (S, P)."""
        return self._kernel(asked, theta) @ self.weights(theta, outputs)

    def rms(self, theta: Parameters, outputs: Floats, asked: Floats, expected: Floats) -> float:
        """RMS error, over sequences, of outputs (S, outputs) at `theta` (S, P), each predicted from all the others
        (Rasmussen and Williams 2006, 5.12), and of those `expected` (A, outputs) at `asked` (A, P)."""
        factor, lower = self._factor(theta)
        (invert,) = get_lapack_funcs(("potri",), (factor,))
        inverse = invert(factor, lower=lower)[0]
        inverse = np.tril(inverse) + np.tril(inverse, -1).T
        weights = inverse @ outputs
        left_out = weights / np.diag(inverse)[:, None]
        missed = self._kernel(asked, theta) @ weights - expected
        return float(np.hypot(np.linalg.norm(left_out), np.linalg.norm(missed)) / np.sqrt(len(theta) + len(asked)))

    def _kernel(self, one: Floats, other: Floats) -> Floats:
        return matern(one / self.scales, other / self.scales, self.order)

    def _factor(self, theta: Parameters) -> tuple[Floats, bool]:
        return cho_factor(self._kernel(theta, theta) + self.ridge * np.eye(len(theta)), lower=True)


def search_ridge(
    known: Parameters,
    outputs: Floats,
    val: tuple[Floats, Floats] | None = None,
    start: Ridge | None = None,
    orders: Sequence[int] = ORDERS[:1],
) -> tuple[Ridge, ...]:
    """The settings that Nelder-Mead finds from `start`, or else from each of several, the best first.

    They minimise the RMS error of predictions from training motions other than the one predicted: the leave-one-out
    error of training `outputs` (S, outputs) at `known` (S, P), together with the error of the motions `val`, which are
    theta (V, P) and outputs (V, outputs). Few validation motions alone tell less. Kernels of several `orders` are tried
    without `start`; one that is not of the first comes before those that are where its error is clearly smaller.
    """
    asked, expected = (known[:0], outputs[:0]) if val is None else val

    def ridge(settings: Floats, order: int) -> Ridge:
        return Ridge(np.exp(settings[:-1]), float(np.exp(settings[-1])), order)

    def objective(settings: Floats, order: int) -> float:
        try:
            return ridge(settings, order).rms(known, outputs, asked, expected)
        except np.linalg.LinAlgError:
            return float("inf")  # the kernel matrix is singular to rounding

    length, noise = BOUNDS
    limits = {"maxfev": EVALUATIONS, "xatol": 1e-2, "fatol": 1e-9}
    same = [np.full(known.shape[1], scale) for scale in STARTS]
    starts = (start,) if start else [Ridge(scales, RIDGE, order) for order in orders for scales in same]
    found = []
    for one in starts:
        begin = np.log([*one.scales, one.ridge])
        bounds = [*[length] * known.shape[1], noise]
        trial = minimize(objective, begin, (one.order,), method="Nelder-Mead", bounds=bounds, options=limits)
        found.append(replace(ridge(trial.x, one.order), error=float(trial.fun)))
    return tuple(sorted(found, key=lambda trial: trial.error / (1.0 if trial.order == orders[0] else SMOOTHER)))
