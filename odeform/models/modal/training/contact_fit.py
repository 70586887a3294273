"""The few numbers of the mechanics, fitted to training motions of all bodies at once."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, replace

import numpy as np
from scipy.optimize import least_squares

from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.modal.training.pushes import Pushes
from odeform.motion.reduced_space import POSE
from odeform.types import Floats

__all__ = ["FINE", "described", "fit_contact_parameters", "relative_errors"]

STEP, FINE = 2.5e-3, 1e-3  # s: steps of the integration during the fit, and of motions by what is found
RANGE = 30.0  # factor by which a number may differ from where it starts
EVALUATIONS = 5  # of the errors and their derivatives
NAMES = tuple(asdict(ContactParameters()))


def relative_errors(pushes: Pushes, predicted: Floats) -> Floats:
    """Computes (S, T - 1, 6 + K): errors in units of the RMS rigid motion and the RMS deformation, without frame 0."""
    error = ((predicted - pushes.reduced) * pushes.scale)[:, 1:]
    truth = (pushes.reduced * pushes.scale)[:, 1:]
    for part in (slice(0, POSE), slice(POSE, None)):
        size = np.sqrt((truth[..., part] ** 2).sum(axis=-1).mean())
        error[..., part] /= max(float(size), 1e-12) * np.sqrt(error.shape[0] * error.shape[1])
    return error


def fit_contact_parameters(
    bodies: Sequence[Pushes],
    pulse: float,
    start: ContactParameters,
    names: Sequence[str] = NAMES,
    report: Callable[[str], None] = print,
    evaluations: int | None = None,
    prior: float = 0.0,
    needed: Callable[[ContactParameters], bool] = lambda _: True,
) -> ContactParameters:
    """Fits the contact parameters with the smallest squared relative errors over all bodies, by Gauss-Newton in
    logarithms.

    Rigid motion and deformation of each body count alike. Errors and their derivatives are evaluated `EVALUATIONS`
    times, or as often as `evaluations` says. `prior` weighs squared logarithms of what they differ by from `start`.

    `needed` is told of the best ones so far at each evaluation; where it returns false, they are the result.
    """
    first = asdict(start)

    def contact_parameters(x: Floats) -> ContactParameters:
        return replace(start, **{name: first[name] * float(np.exp(v)) for name, v in zip(names, x, strict=True)})

    least: tuple[float, Floats] = np.inf, np.zeros(len(names))

    def errors(x: Floats) -> Floats:
        nonlocal least
        if not needed(contact_parameters(least[1])):
            raise _NotNeeded
        parts = [
            relative_errors(pushes, pushes.predicted(contact_parameters(x), pulse, STEP)).ravel() for pushes in bodies
        ]
        parts.append(np.sqrt(prior) * x)
        found = np.nan_to_num(np.concatenate(parts), nan=10.0, posinf=10.0, neginf=-10.0)
        least = min(least, (float(found @ found), x.copy()), key=lambda one: one[0])
        return found

    limit = np.log(RANGE)
    with suppress(_NotNeeded):
        least_squares(
            errors,
            np.zeros(len(names)),
            bounds=(-limit, limit),
            diff_step=0.02,
            max_nfev=evaluations or EVALUATIONS,
            x_scale=0.3,
        )
    best = contact_parameters(least[1])
    report(f"contact parameters: relative error {np.sqrt(least[0] / len(bodies)):.3f}; {described(best)}")
    return best


class _NotNeeded(Exception):
    """Ends a fit before it has converged."""


def described(contact_parameters: ContactParameters) -> str:
    """Returns names and values in one line."""
    return ", ".join(f"{name} {value:.3g}" for name, value in asdict(contact_parameters).items())
