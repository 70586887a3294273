"""What experiments tell of a body where motions are linear functions of it, around one body."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.search import Problem, information_of
from odeform.identification.pushed.state import BODY, Camera, body_steps
from odeform.identification.pushed.trials import Trials
from odeform.identification.pushed.views import points_of
from odeform.types import Floats, Frames

__all__ = ["Linearised", "linearised"]


@dataclass(frozen=True, eq=False)
class Linearised:
    """Normal equations of E experiments, in halves of the ranges of `BODY`."""

    informations: Float[np.ndarray, "experiments body body"]
    scores: Float[np.ndarray, "experiments body"]
    """What the observations pull the body towards: zero, but for noise, where it moved as the model says."""


def linearised(
    forward: Forward,
    trials: Trials,
    body: Floats,
    noise_mm: float,
    observed: list[Frames] | None = None,
) -> Linearised:
    """Linearises motions around a body (3,) by differences, of which points of the surface are seen with `noise_mm`.

    `observed` is E times (T, S, 3) m; by default the body moves as the model says.
    """
    base, steps = trials.surfaces(body), body_steps(body)
    changes = np.stack([trials.surfaces(body + step) - base for step in steps])
    slopes = np.einsum("fs,se...->ef...", np.linalg.inv(steps), changes)
    free, out = tuple(range(len(BODY))), []
    for index, (moved, along) in enumerate(zip(base, slopes, strict=True)):
        seen = moved if observed is None else observed[index]
        evidence = points_of(trials.times[index], seen, forward.model.rest.faces, noise_mm)
        problem = Problem(forward, evidence, trials.errors_mm[index], free)
        out.append(information_of(problem, evidence.compared(moved, along, Camera())))
    return Linearised(np.stack([row[0] for row in out]), np.stack([row[1] for row in out]))
