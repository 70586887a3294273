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

from odeform.models.matern import matern, scaled_distance
from odeform.types import Floats

__all__ = ["Kernel", "fit_kernel"]

STARTS = (1.0, 3.0)  # length scales that the search starts from, in standard deviations of the inputs
NOISE = 1e-2  # where it starts, relative to the signal
STEPS = 40
PRIOR = 2e-3  # weight of (log length scale - 1)^2: scales that do not matter stay where they are
BOUNDS = {"scale": (-2.0, 6.0), "noise": (-14.0, 1.0), "linear": (-8.0, 8.0)}  # logarithms

Inputs = Float[np.ndarray, "rows inputs"]
Forces = Float[np.ndarray, "rows 3"]
Outputs = Float[np.ndarray, "rows outputs"]


@dataclass(frozen=True, eq=False)
class Kernel:
    """Logarithms of the settings: scales l (D,), noise, and for a linear term m (P,) of the first inputs, and v."""

    logs: Float[np.ndarray, " settings"]
    inputs: int
    places: int
    """P, the inputs that a linear term varies with; 0 without one."""

    @property
    def noise(self) -> float:
        """Relative to the signal."""
        return float(np.exp(self.logs[self.inputs]))

    def __call__(
        self,
        x: Inputs,
        force: Forces,
        other: Float[np.ndarray, "columns inputs"],
        other_force: Float[np.ndarray, "columns 3"],
    ) -> Floats:
        """(rows, columns) covariances between two sets of inputs and forces, in units of the signal."""
        scales = np.exp(self.logs[: self.inputs])
        out = matern(x / scales, other / scales)
        if self.places:
            places = np.exp(self.logs[self.inputs + 1 : -1])
            near = matern(x[:, : self.places] / places, other[:, : self.places] / places)
            out = out + np.exp(self.logs[-1]) * near * (force @ other_force.T)
        return out


def fit_kernel(x: Inputs, force: Forces, outputs: Outputs, linear: int) -> Kernel:
    """The kernel of inputs x (S, D), forces (S, 3) and outputs (S, M), of the best of several starts.

    `linear` is the number of first inputs that a term linear in the force varies with; 0 for none.
    """
    size, places = x.shape[1], linear
    scale, noise, share = (BOUNDS[key] for key in ("scale", "noise", "linear"))
    bounds = [*[scale] * size, noise, *([*[scale] * places, share] if places else [])]
    found = []
    for start in np.log(STARTS):
        begin = [*[start] * size, np.log(NOISE), *([*[start] * places, 0.0] if places else [])]
        objective = _Objective(x, force, outputs, size, places)
        found.append(minimize(objective, begin, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": STEPS}))
    best = min(found, key=lambda trial: trial.fun)
    return Kernel(best.x, size, places)


@dataclass(frozen=True, eq=False)
class _Objective:
    """log |K| / S + log tr(Y' K^-1 Y), which is the negative log likelihood per output, and its gradient."""

    x: Inputs
    force: Forces
    outputs: Outputs
    size: int
    places: int

    def __call__(self, logs: Floats) -> tuple[float, Floats]:
        kernel, count = Kernel(logs, self.size, self.places), len(self.x)
        covariance = kernel(self.x, self.force, self.x, self.force)
        try:
            factor = cho_factor(covariance + kernel.noise * np.eye(count), lower=True)
        except LinAlgError:
            return 1e9, np.zeros(len(logs))
        inverse = cho_solve(factor, np.eye(count))
        weights = inverse @ self.outputs
        fit = float((self.outputs * weights).sum())
        value = 2.0 * float(np.log(np.diag(factor[0])).mean()) + np.log(fit)
        slope = inverse / count - weights @ weights.T / fit
        gradient = [self._by_scales(logs[: self.size], self.x, slope), [kernel.noise * np.trace(slope)]]
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
