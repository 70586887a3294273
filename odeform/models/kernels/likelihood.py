"""Gaussian-process regression of many outputs: kernel, length scales and noise of the largest marginal likelihood.

k(x, x') = matern(x / l, x' / l) + v matern(c / m, c' / m) f.f', with a length scale for each input in l and m: the
second term, if there is one, is linear in the force f, with a response that varies with the place c (Rasmussen and
Williams 2006, 4.2 and 5.4). All outputs share the kernel and one signal variance, which is profiled out.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.optimize import minimize

from odeform.models.kernels.functions import matern, scaled_distance
from odeform.models.kernels.regression import Kernel, LinearTerm
from odeform.models.kernels.ridge import Ridge
from odeform.types import Floats

__all__ = ["MarginalLikelihood", "fit_kernel", "ridge_of"]

STARTS = (1.0, 3.0)  # length scales that the search starts from, in standard deviations of the inputs
NOISE = 1e-2  # where it starts, relative to the signal
STEPS = 40
PRIOR = 2e-3  # weight of (log length scale - 1)^2: scales that do not matter stay where they are
BOUNDS = {"scale": (-2.0, 6.0), "noise": (-14.0, 1.0), "linear": (-8.0, 8.0)}  # logarithms

Inputs = Float[np.ndarray, "rows inputs"]
Forces = Float[np.ndarray, "rows 3"]
Outputs = Float[np.ndarray, "rows outputs"]


def ridge_of(logs: Float[np.ndarray, " settings"], inputs: int, places: int) -> Ridge:
    """The kernel and ridge of settings as files hold them: logarithms of the length scales (D,) and the ridge; with a
    linear term, of its length scales (P,) and its variance as well."""
    values = np.exp(logs.astype(float))
    linear = LinearTerm(values[inputs + 1 : -1], float(values[-1])) if places else None
    return Ridge(Kernel(values[:inputs], linear=linear), float(values[inputs]))


def fit_kernel(x: Inputs, force: Forces, outputs: Outputs, linear: int) -> Floats:
    """The settings, as `ridge_of` reads them, for inputs x (S, D), forces (S, 3) and outputs (S, M): the best that
    several starts find.

    `linear` is the number of first inputs that a term linear in the force varies with; 0 for none.
    """
    size, places = x.shape[1], linear
    scale, noise, ratio = (BOUNDS[key] for key in ("scale", "noise", "linear"))
    bounds = [*[scale] * size, noise, *([*[scale] * places, ratio] if places else [])]
    found = []
    for start in np.log(STARTS):
        begin = [*[start] * size, np.log(NOISE), *([*[start] * places, 0.0] if places else [])]
        objective = MarginalLikelihood(x, force, outputs, size, places)
        found.append(minimize(objective, begin, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": STEPS}))
    best = min(found, key=lambda trial: trial.fun)
    return best.x


@dataclass(frozen=True, eq=False)
class MarginalLikelihood:
    """log |K| / S + log tr(Y' K^-1 Y), which is the negative log likelihood per output, and its gradient."""

    x: Inputs
    force: Forces
    outputs: Outputs
    size: int
    places: int

    def __call__(self, logs: Floats) -> tuple[float, Floats]:
        fit, count = ridge_of(logs, self.size, self.places), len(self.x)
        both = np.concatenate([self.x, self.force], axis=1)
        try:
            factor = cho_factor(fit.kernel(both, both) + fit.ridge * np.eye(count), lower=True)
        except LinAlgError:
            return 1e9, np.zeros(len(logs))
        inverse = cho_solve(factor, np.eye(count))
        weights = inverse @ self.outputs
        power = float((self.outputs * weights).sum())
        value = 2.0 * float(np.log(np.diag(factor[0])).mean()) + np.log(power)
        slope = inverse / count - weights @ weights.T / power
        gradient = [self._by_scales(logs[: self.size], self.x, slope), [fit.ridge * np.trace(slope)]]
        if self.places:
            where, places = self.x[:, : self.places], logs[self.size + 1 : -1]
            linear = np.exp(logs[-1]) * (self.force @ self.force.T) * slope
            near = matern(where / np.exp(places), where / np.exp(places))
            gradient += [self._by_scales(places, where, linear), [(linear * near).sum()]]
        scales = np.concatenate([np.arange(self.size), np.arange(self.size + 1, len(logs) - 1)]).astype(int)
        gradient = np.concatenate(gradient)
        gradient[scales] += 2.0 * PRIOR * (logs[scales] - 1.0)
        return value + PRIOR * float(((logs[scales] - 1.0) ** 2).sum()), gradient

    @staticmethod
    def _by_scales(logs: Floats, x: Inputs, slope: Floats) -> Floats:
        """(D,) derivatives by the logarithms of length scales, given those by the entries of the Matern matrix."""
        scaled = x / np.exp(logs)
        r = scaled_distance(scaled, scaled)
        pull = slope * (5.0 / 3.0) * (1.0 + r) * np.exp(-r)
        return 2.0 * (pull.sum(axis=1) @ scaled**2 - np.einsum("id,ij,jd->d", scaled, pull, scaled, optimize=True))
