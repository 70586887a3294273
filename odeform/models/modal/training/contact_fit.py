"""The few numbers of the mechanics, fitted to training motions of all bodies at once."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace

import numpy as np
from scipy.optimize import least_squares

from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.modal.training.pushes import Pushes
from odeform.motion.reduced_space import POSE
from odeform.types import Floats

__all__ = ["FINE", "described", "fit_law", "relative_errors"]

STEP, FINE = 2.5e-3, 1e-3  # s, of the integration while a law is fitted, and of motions by the one that is found
RANGE = 30.0  # factor by which a number may differ from where it starts
EVALUATIONS = 5  # of the errors and their derivatives
NAMES = tuple(asdict(ContactParameters()))


def relative_errors(pushes: Pushes, predicted: Floats) -> Floats:
    """(S, T - 1, 6 + K): errors in units of the RMS rigid motion and the RMS deformation, without frame 0."""
    error = ((predicted - pushes.reduced) * pushes.scale)[:, 1:]
    truth = (pushes.reduced * pushes.scale)[:, 1:]
    for part in (slice(0, POSE), slice(POSE, None)):
        size = np.sqrt((truth[..., part] ** 2).sum(axis=-1).mean())
        error[..., part] /= max(float(size), 1e-12) * np.sqrt(error.shape[0] * error.shape[1])
    return error


def fit_law(
    bodies: Sequence[Pushes],
    pulse: float,
    start: ContactParameters,
    names: Sequence[str] = NAMES,
    report: Callable[[str], None] = print,
    evaluations: int | None = None,
) -> ContactParameters:
    """The law with the smallest squared relative errors over all bodies, by Gauss-Newton in logarithms.

    Rigid motion and deformation of each body count alike. Errors and their derivatives are evaluated `EVALUATIONS`
    times, or as often as `evaluations` says.
    """
    first = asdict(start)

    def law(x: Floats) -> ContactParameters:
        return replace(start, **{name: first[name] * float(np.exp(v)) for name, v in zip(names, x, strict=True)})

    def errors(x: Floats) -> Floats:
        parts = [relative_errors(pushes, pushes.predicted(law(x), pulse, STEP)).ravel() for pushes in bodies]
        return np.nan_to_num(np.concatenate(parts), nan=10.0, posinf=10.0, neginf=-10.0)

    limit = np.log(RANGE)
    found = least_squares(
        errors,
        np.zeros(len(names)),
        bounds=(-limit, limit),
        diff_step=0.02,
        max_nfev=evaluations or EVALUATIONS,
        x_scale=0.3,
    )
    report(f"law: relative error {np.sqrt(2.0 * found.cost / len(bodies)):.3f}; {described(law(found.x))}")
    return law(found.x)


def described(law: ContactParameters) -> str:
    """In one line."""
    return ", ".join(f"{name} {value:.3g}" for name, value in asdict(law).items())
