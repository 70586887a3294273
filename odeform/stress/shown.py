"""Whether what is shown of motions stays physical, for all parameters of the trained box and all times."""

from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from odeform.models.base import Predictor
from odeform.models.registry import load_reduced
from odeform.parallel import parallel_map
from odeform.schema import REACH, Parameters
from odeform.stress.cases import inside
from odeform.stress.check import Check, Checks

__all__ = ["DRAWS", "Shown", "check_shown", "shown"]

DRAWS = 5_000
BATCH = 32  # draws that a process takes at a time
FAR = 10.0  # windows; nothing moves any more


@dataclass(frozen=True)
class Shown:
    """Holds what is shown of one motion: the largest depth below the floor in metres, the number of frames that
    are not finite, and the seconds from which on it is clamped, if it is."""

    depth: float
    non_finite: int
    stopped: float | None


def shown(predictor: Predictor, parameters: Parameters, seed: int = 0) -> Shown:
    """One motion of the trained body, from the start to the end of the time axis, at frames shifted by a random part of
    a frame."""
    window = predictor.schema.window
    count = round((1.0 + REACH) * (window.stop - window.start) * window.rate)
    begin = np.random.default_rng(seed).uniform()
    times = np.append(window.start + (begin + np.arange(count)) / window.rate, FAR * window.stop)
    motion = predictor.solve(None, parameters)
    heights = motion.vertices(times)[..., 2]
    finite = np.isfinite(heights).all(axis=1)
    floor = motion.validity.limits.floor
    depth = 0.0 if floor is None or not finite.any() else floor - float(heights[finite].min())
    stop = motion.first_stop()
    return Shown(max(depth, 0.0), int((~finite).sum()), None if stop is None else stop.time)


def check_shown(checkpoint: str, count: int = DRAWS, seed: int = 0) -> tuple[Checks, dict[str, Any]]:
    """The checks over `count` draws from the trained box, and how many of them are clamped and from when on."""
    predictor = load_reduced(checkpoint)
    draws = list(enumerate(inside(predictor.schema, count, seed)))
    found = parallel_map("motions inside the box", partial(_shown_from, checkpoint), draws, batch_size=BATCH)
    stopped = [one.stopped for one in found if one.stopped is not None]
    checks = {
        "shown_below_floor_mm": Check(1e3 * max(one.depth for one in found), 1e3 * predictor.validity.limits.depth),
        "shown_non_finite_frames": Check(sum(one.non_finite for one in found), 0),
    }
    return checks, {
        "draws": count,
        "stopped": len(stopped),
        "stopped_in_window": sum(time < predictor.schema.window.stop for time in stopped),
        "first_stop_s": min(stopped, default=None),
    }


@cache
def _opened(checkpoint: str) -> Predictor:
    """Opened once in each process."""
    return load_reduced(checkpoint)


def _shown_from(checkpoint: str, draw: tuple[int, Parameters]) -> Shown:
    seed, parameters = draw
    return shown(_opened(checkpoint), parameters, seed)
