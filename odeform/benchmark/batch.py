"""How long motions take that are solved together, beside a loop."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from odeform.benchmark.probes import random_parameters
from odeform.models.base import Predictor
from odeform.schema import OBJECT

__all__ = ["batch_speed"]

MOTIONS, LOOP = 256, 32
TIMES = 4  # of each motion, at which its vertices are asked for


def batch_speed(predictor: Predictor) -> dict[str, Any]:
    """Measures the milliseconds a motion of `solve_batch` for `MOTIONS` of the default body, and of a loop of
    `solve` over the first `LOOP` of them: with their vertices at `TIMES` times each."""
    sets = random_parameters(predictor, MOTIONS)
    arrays = {name: np.array([given[name] for given in sets]) for name in sets[0] if name != OBJECT}
    shared = {OBJECT: sets[0][OBJECT]} if OBJECT in sets[0] else {}
    window = predictor.schema.window
    times = np.linspace(window.start, window.stop, TIMES + 1)[1:]

    def one_by_one() -> None:
        for given in sets[:LOOP]:
            predictor.solve(parameters=given).vertices(times)

    def together(count: int) -> None:
        some = {name: values[:count] for name, values in arrays.items()}
        predictor.solve_batch({**shared, **some}).vertices(times)

    together(2)  # what a first call prepares
    batch, alone = _ms(lambda: together(MOTIONS)), _ms(one_by_one)
    return {"motions": MOTIONS, "ms_a_motion": batch / MOTIONS, "loop_ms_a_motion": alone / LOOP}


def _ms(work: Callable[[], None]) -> float:
    begin = time.perf_counter()
    work()
    return 1e3 * (time.perf_counter() - begin)
