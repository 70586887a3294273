"""Parameters within their trained range that explain an observation best: Levenberg-Marquardt from several starts.

`scipy.optimize.least_squares` (trf, with whitened residuals) finds the same parameters, but takes five to seven times
as long: correlated model errors make the residuals dense, while the normal equations have 6 + K unknowns a frame.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from odeform.identification.discrepancy import Discrepancy
from odeform.identification.linear import Comparison, Linear
from odeform.types import Floats

__all__ = ["ParameterFit", "fit_parameters", "normal_equations"]

STARTS, MOST_REFINED = 16, 5
ROUNDS = 12
CLOSE = 1e-2  # squared standard deviations: converged if an undamped step is shorter
DAMPING = (1e-3, 0.2, 5.0)  # initially; factor after an accepted step; after a rejected one
LARGEST = 1e6
COARSE = (16, 40)  # points and frames on which starts are compared


@dataclass(frozen=True, eq=False)
class ParameterFit:
    """`theta` (P,) in [-1, 1], its Fisher `information` (P, P), and `misfit`, the mean square of the residuals relative
    to their expectation: at most 1 if model and noise explain the observation. `converged` if another step would have
    changed hardly anything."""

    theta: Floats
    information: Floats
    misfit: float
    converged: bool


def normal_equations(linear: Linear, variances: Floats, noise_mm: float) -> tuple[Floats, Floats, float]:
    """Returns J' C^-1 J (P, P), J' C^-1 r (P,) and r' C^-1 r, of r with covariance C = noise^2 + spread variances
    spread'.

    The Woodbury identity keeps the system at 6 + K unknowns a frame, also where there are fewer points.
    """
    square, deviations = noise_mm**2, np.sqrt(variances)[:, :, None]
    turned = linear.spread.swapaxes(1, 2)
    normal, pulled = turned @ linear.spread, turned @ linear.residual[..., None]
    causes = np.arange(normal.shape[1])
    inner = deviations * normal * deviations.swapaxes(1, 2)
    inner[:, causes, causes] += square
    known = np.concatenate([deviations * (normal @ linear.jacobian), deviations * pulled], axis=2)
    solved = np.linalg.solve(inner, known)
    jacobian = linear.jacobian / deviations
    information = np.einsum("tkp,tkq->pq", jacobian, solved[..., :-1])
    score = np.einsum("tkp,tk->p", jacobian, solved[..., -1])
    cost = float((linear.residual**2).sum() - (known[..., -1] * solved[..., -1]).sum()) / square
    return 0.5 * (information + information.T), score, cost


def fit_parameters(
    comparison: Comparison, discrepancy: Discrepancy, progress: Callable[[Floats, float], None] = lambda *_: None
) -> ParameterFit:
    """Compare starts over the box (Sobol points), and refine them, the best first, until one explains the observation.

    Landings can make the misfit rough, so that a search does not converge: then until two explain it. The best result
    is returned. `progress` gets theta (P,) and the misfit before each step.
    """
    coarse = Comparison(comparison.predictor, comparison.observation.subsampled(*COARSE))
    size = len(comparison.predictor.schema.learned)
    # the first Sobol point is a corner, the second the middle of the box
    spread = 2.0 * qmc.Sobol(size, scramble=False).random(STARTS)[1:] - 1.0

    def cost(theta: Floats) -> float:
        observation = coarse.observation
        linear = discrepancy.minus_mean(coarse.at(theta, sloped=False), theta, observation.times)
        return normal_equations(linear, discrepancy.at(observation.times), observation.noise_mm)[2]

    refined: list[ParameterFit] = []
    for start in sorted(spread, key=cost)[:MOST_REFINED]:
        explained = [one for one in refined if one.misfit <= 1.0]
        if len(explained) > 1 or any(one.converged for one in explained):
            break
        refined.append(_refined(comparison, discrepancy, start, progress))
    return min(refined, key=lambda one: one.misfit)


def _refined(
    comparison: Comparison, discrepancy: Discrepancy, start: Floats, progress: Callable[[Floats, float], None]
) -> ParameterFit:
    observation = comparison.observation
    variances = discrepancy.at(observation.times)

    def equations(theta: Floats) -> tuple[Floats, Floats, float]:
        linear = discrepancy.minus_mean(comparison.at(theta), theta, observation.times)
        return normal_equations(linear, variances, observation.noise_mm)

    theta, damping, converged = start, DAMPING[0], False
    information, score, cost = equations(theta)
    for _ in range(ROUNDS):
        progress(theta, cost / observation.positions.size)
        undamped = _bounded_step(information, score, theta, 0.0)
        converged = bool(undamped @ information @ undamped < CLOSE)
        if converged or damping > LARGEST:
            break
        step = _bounded_step(information, score, theta, damping)
        trial = equations(theta + step)
        if trial[2] < cost:
            theta, (information, score, cost), damping = theta + step, trial, damping * DAMPING[1]
        else:
            damping *= DAMPING[2]
    return ParameterFit(theta, information, cost / observation.positions.size, converged)


def _bounded_step(information: Floats, score: Floats, theta: Floats, damping: float) -> Floats:
    """The damped Gauss-Newton step within the box: parameters that would leave it stop at their bound, and the others
    are solved again."""
    damped = information + damping * np.diag(np.diag(information)) + 1e-12 * np.eye(len(theta))
    step, free = np.zeros(len(theta)), np.ones(len(theta), dtype=bool)
    while free.any():
        left = score - damped @ np.where(free, 0.0, step)
        step[free] = np.linalg.solve(damped[np.ix_(free, free)], left[free])
        out = free & (np.abs(theta + step) > 1.0)
        if not out.any():
            break
        step[out] = np.sign(theta[out] + step[out]) - theta[out]
        free &= ~out
    return step
