"""Kernel ridge regression (Matern), and the search for its length scales, its ridge and the order of its kernel."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve, get_lapack_funcs
from scipy.optimize import minimize

from odeform.models.kernels.regression import Kernel, KernelRegression
from odeform.types import Floats

__all__ = ["ORDERS", "Ridge", "search_ridge"]

ORDERS = (2, 6)
"""Orders of the kernels to choose from: contacts make motions rough in the parameters, without them they are smooth."""

STARTS = (0.5, 2.0, 8.0)  # length scales that the search starts from; the trained range is 2 long
RIDGE = 1e-6  # where it starts, relative to the kernel's value at distance 0
SMOOTHER = 0.85  # fraction of the error of the first order that another may have at most: a rough kernel risks less
EVALUATIONS = 150  # of the error, from each start
BOUNDS = ((np.log(0.05), np.log(200.0)), (np.log(1e-12), 0.0))  # of length scales and ridge, in logarithms

Inputs = Float[np.ndarray, "known inputs"]


@dataclass(frozen=True, eq=False)
class Ridge:
    """A kernel and the ridge of a regression with it, and the `error` that they were chosen by."""

    kernel: Kernel
    ridge: float
    """Relative to the kernel's value at distance 0."""
    error: float = float("inf")

    def fit(self, x: Inputs, outputs: Float[np.ndarray, "known outputs"]) -> KernelRegression:
        """Fits the regression of outputs (S, M) on inputs (S, D)."""
        return KernelRegression(self.kernel, x, cho_solve(self._factor(x), outputs))

    def leave_one_out(self, x: Inputs, outputs: Floats) -> tuple[Floats, KernelRegression]:
        """(S, M) what each output differs by from what all the others predict (Rasmussen and Williams 2006, 5.12), and
        the regression on all."""
        factor, lower = self._factor(x)
        (invert,) = get_lapack_funcs(("potri",), (factor,))
        inverse = invert(factor, lower=lower)[0]
        inverse = np.tril(inverse) + np.tril(inverse, -1).T
        weights = inverse @ outputs
        return weights / np.diag(inverse)[:, None], KernelRegression(self.kernel, x, weights)

    def rms(self, x: Inputs, outputs: Floats, asked: Floats, expected: Floats) -> float:
        """Returns the RMS error, over sequences, of outputs (S, M) at `x` (S, D), each predicted from all the
        others, and of those `expected` (A, M) at `asked` (A, D)."""
        left_out, regression = self.leave_one_out(x, outputs)
        residual = regression(asked) - expected
        return float(np.hypot(np.linalg.norm(left_out), np.linalg.norm(residual)) / np.sqrt(len(x) + len(asked)))

    def _factor(self, x: Inputs) -> tuple[Floats, bool]:
        return cho_factor(self.kernel(x, x) + self.ridge * np.eye(len(x)), lower=True)


def search_ridge(
    known: Inputs,
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

    def ridge(settings: Floats, order: int | None) -> Ridge:
        return Ridge(Kernel(np.exp(settings[:-1]), order), float(np.exp(settings[-1])))

    def objective(settings: Floats, order: int | None) -> float:
        try:
            return ridge(settings, order).rms(known, outputs, asked, expected)
        except np.linalg.LinAlgError:
            return float("inf")  # the kernel matrix is singular to rounding

    length, noise = BOUNDS
    limits = {"maxfev": EVALUATIONS, "xatol": 1e-2, "fatol": 1e-9}
    same = [np.full(known.shape[1], scale) for scale in STARTS]
    starts = (start,) if start else [Ridge(Kernel(scales, order), RIDGE) for order in orders for scales in same]
    found = []
    for one in starts:
        begin, order = np.log([*one.kernel.scales, one.ridge]), one.kernel.order
        bounds = [*[length] * known.shape[1], noise]
        trial = minimize(objective, begin, (order,), method="Nelder-Mead", bounds=bounds, options=limits)
        found.append(replace(ridge(trial.x, order), error=float(trial.fun)))
    return tuple(sorted(found, key=lambda trial: trial.error / (1.0 if trial.kernel.order == orders[0] else SMOOTHER)))
