"""Draws pushes, drops and throws of a body, and solves what each would tell of it."""

import numpy as np

from odeform.errors import InputError
from odeform.identification.pushed.experiment import Candidates
from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.linearised import linearised
from odeform.identification.pushed.state import body_steps
from odeform.identification.pushed.trials import Falls, Pushes, Trials
from odeform.loads.measured import FALLS
from odeform.loads.registry import get_load
from odeform.types import Floats, Times

__all__ = ["candidates"]

PUSHED, FALLING = 32, 8
"""Experiments that are tried: pushes, and as many of each load under which bodies fall."""


def candidates(
    forward: Forward, body: Floats, forces: tuple[float, float], noise_mm: float, errors_mm: Times, seed: int = 0
) -> Candidates:
    """Draws experiments with the body (3,), and solves what they tell.

    Pushes are of the weakest to the strongest of `forces` in newton, by a model that is wrong by `errors_mm` (T,);
    drops and throws are from the ranges of their loads. All are observed at points of the surface with `noise_mm`.
    """
    bodies = [body, *(body + body_steps(body))]
    trials: list[Trials] = [
        Pushes(forward, bodies, forces, errors_mm, PUSHED, seed),
        *(Falls(forward, body, get_load(load), FALLING, seed) for load in FALLS),
    ]
    found = [one for one in trials if one.experiments]
    if not found:
        raise InputError("identify: no experiment with this body was found")
    told = [linearised(forward, one, body, noise_mm).informations for one in found]
    return Candidates([one for each in found for one in each.experiments], np.concatenate(told))
