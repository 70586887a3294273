"""Estimates with their intervals, from the curvature of a likelihood and from what simulations corrected."""

import numpy as np

from odeform.identification.discrepancy import TWO_SIDED
from odeform.identification.identify import Identified
from odeform.identification.pushed.search import Found, Problem
from odeform.identification.pushed.state import BODY, PUSH_STEPS, PushState
from odeform.types import Floats

__all__ = ["estimates_of", "posterior_of"]


def posterior_of(problem: Problem, found: Found) -> tuple[Floats, Floats]:
    """Covariances (F, F) of what is unknown but the camera: with the prior, and of the observation alone."""
    size, scale = len(problem.free), max(found.misfit, 1.0)
    information = found.information / scale
    with_prior = np.linalg.inv(information + np.diag(problem.precision()))
    alone = np.linalg.inv(information + 1e-6 * np.eye(len(information)))
    return with_prior[:size, :size], alone[:size, :size]


def estimates_of(problem: Problem, found: Found, widened: float, last: Floats | None) -> dict[str, Identified]:
    """Returns estimates, with intervals that are `widened` times as wide as those of the posterior, to which the `last`
    step of the estimate (9,) adds, if simulations corrected it."""
    state, free = found.state, list(problem.free)
    step = np.zeros(len(free)) if last is None else _in_steps(state, last)[free]
    posterior, alone = (
        widened**2 * (covariance + np.outer(step, step) / TWO_SIDED**2) for covariance in posterior_of(problem, found)
    )
    out: dict[str, Identified] = {}
    for index, name in enumerate(BODY):
        if index in free:
            at = free.index(index)
            half = TWO_SIDED * float(np.sqrt(posterior[at, at]))
            narrow = TWO_SIDED * float(np.sqrt(alone[at, at])) < 1.0
            unit, parameter = float(state.body[index]), problem.forward.ranges[index]
            low, high = (parameter.denormalise(float(np.clip(unit + side * half, -1.0, 1.0))) for side in (-1.0, 1.0))
            out[name] = Identified(parameter.denormalise(unit), low, high, narrow, unit, half)
    if len(BODY) in free:
        first = free.index(len(BODY))
        parts = (
            ("contact", state.contact, slice(first, first + 2), state.size * state.tangents, state.size),
            ("force", state.force, slice(first + 2, first + PUSH_STEPS), state.strongest * np.eye(3), state.strongest),
        )
        for kind, vector, rows, span, scale in parts:
            wide, narrow = (span.T @ covariance[rows, rows] @ span for covariance in (alone, posterior))
            out |= _vector(kind, vector, narrow, wide, scale)
    return out


def _in_steps(state: PushState, vector: Floats) -> Floats:
    """(9,) a difference of `PushState.vector` -> (8,) the step of `PushState.stepped` along it."""
    body, contact, force = np.split(vector, [len(BODY), len(BODY) + 3])
    return np.concatenate([body, state.tangents @ contact, force])


def _vector(kind: str, value: Floats, covariance: Floats, alone: Floats, scale: float) -> dict[str, Identified]:
    """Three estimates, of which `scale` is half of the range."""
    out = {}
    for axis, x, variance, wide in zip("xyz", value, np.diag(covariance), np.diag(alone), strict=True):
        half = TWO_SIDED * float(np.sqrt(variance))
        narrow = TWO_SIDED * float(np.sqrt(wide)) < scale
        x = float(x)
        out[f"{kind}_{axis}"] = Identified(x, x - half, x + half, narrow, x / scale, half / scale)
    return out
