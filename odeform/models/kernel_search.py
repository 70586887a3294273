"""Kernel ridge regression (Matern 5/2), and the search for its length scales and ridge."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve, get_lapack_funcs
from scipy.optimize import minimize

from odeform.models.contact.kernel import matern
from odeform.types import Floats

__all__ = ["Ridge", "search_ridge"]

STARTS = (0.5, 2.0, 8.0)  # length scales that the search starts from; the trained range is 2 long
RIDGE = 1e-6  # where it starts, relative to the kernel's value at distance 0
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
    error: float = float("inf")

    def weights(self, theta: Parameters, outputs: Float[np.ndarray, "sequences outputs"]) -> Floats:
        """(S, outputs): what training outputs at `theta` (S, P) weigh in a prediction."""
        return cho_solve(self._factor(theta), outputs)

    def predict(self, asked: Floats, theta: Parameters, outputs: Floats) -> Float[np.ndarray, "asked outputs"]:
        """Predictions at `asked` (A, P) from outputs at `theta` (S, P)."""
        return matern(asked / self.scales, theta / self.scales) @ self.weights(theta, outputs)

    def rms(self, theta: Parameters, outputs: Floats, asked: Floats, expected: Floats) -> float:
        """RMS error, over sequences, of outputs (S, outputs) at `theta` (S, P), each predicted from all the others
        (Rasmussen and Williams 2006, 5.12), and of those `expected` (A, outputs) at `asked` (A, P)."""
        factor, lower = self._factor(theta)
        (invert,) = get_lapack_funcs(("potri",), (factor,))
        inverse = invert(factor, lower=lower)[0]
        inverse = np.tril(inverse) + np.tril(inverse, -1).T
        weights = inverse @ outputs
        left_out = weights / np.diag(inverse)[:, None]
        missed = matern(asked / self.scales, theta / self.scales) @ weights - expected
        return float(np.hypot(np.linalg.norm(left_out), np.linalg.norm(missed)) / np.sqrt(len(theta) + len(asked)))

    def _factor(self, theta: Parameters) -> tuple[Floats, bool]:
        scaled = theta / self.scales
        return cho_factor(matern(scaled, scaled) + self.ridge * np.eye(len(theta)), lower=True)


def search_ridge(
    known: Parameters, outputs: Floats, val: tuple[Floats, Floats] | None = None, start: Ridge | None = None
) -> tuple[Ridge, ...]:
    """The settings that Nelder-Mead finds from `start`, or else from each of several, the best first.

    They minimise the RMS error of predictions from training motions other than the one predicted: the leave-one-out
    error of training `outputs` (S, outputs) at `known` (S, P), together with the error of the motions `val`, which are
    theta (V, P) and outputs (V, outputs). Few validation motions alone tell less.
    """
    asked, expected = (known[:0], outputs[:0]) if val is None else val

    def ridge(settings: Floats) -> Ridge:
        return Ridge(np.exp(settings[:-1]), float(np.exp(settings[-1])))

    def objective(settings: Floats) -> float:
        try:
            return ridge(settings).rms(known, outputs, asked, expected)
        except np.linalg.LinAlgError:
            return float("inf")  # the kernel matrix is singular to rounding

    length, noise = BOUNDS
    limits = {"maxfev": EVALUATIONS, "xatol": 1e-2, "fatol": 1e-9}
    starts = (start,) if start else [Ridge(np.full(known.shape[1], scale), RIDGE) for scale in STARTS]
    found = []
    for one in starts:
        begin = np.log([*one.scales, one.ridge])
        bounds = [*[length] * known.shape[1], noise]
        trial = minimize(objective, begin, method="Nelder-Mead", bounds=bounds, options=limits)
        found.append(replace(ridge(trial.x), error=float(trial.fun)))
    return tuple(sorted(found, key=lambda trial: trial.error))
