"""Draws pushes, drops and throws of a body, and solves what each would tell of it."""

import numpy as np

from odeform.errors import InputError
from odeform.identification.pushed.experiment import Candidates
from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.linearised import linearised, steps_from
from odeform.identification.pushed.trials import Falls, Pushes
from odeform.loads.measured import FALLS
from odeform.loads.registry import get_load
from odeform.types import Floats, Times

__all__ = ["candidates"]

PUSHED, FALLING = 32, 12
"""Experiments that are tried: pushes, and as many of each load under which bodies fall."""
MISLEADING = 1.0
"""How many times as far the model's error leads in falls than in pushes, by simulations (docs/identification.md)."""


def candidates(
    forward: Forward, body: Floats, forces: tuple[float, float], noise_mm: float, errors_mm: Times, seed: int = 0
) -> Candidates:
    """Draws experiments with the body (3,), and solves what they tell.

    Pushes are of the weakest to the strongest of `forces` in newton, by a model that is wrong by `errors_mm` (T,);
    drops and throws are from the ranges of their loads. All are observed at points of the surface with `noise_mm`.
    """
    bodies = [body, *(body + steps_from(body))]
    trials = [
        (Pushes(forward, bodies, forces, errors_mm, PUSHED, seed), 1.0),
        *((Falls(forward, body, get_load(load), FALLING, seed), MISLEADING) for load in FALLS),
    ]
    found = [(one, misleading) for one, misleading in trials if one.experiments]
    if not found:
        raise InputError("identify: no experiment with this body was found")
    told = [linearised(forward, one, body, noise_mm, misleading=misleading).informations for one, misleading in found]
    return Candidates([one for each, _ in found for one in each.experiments], np.concatenate(told))
