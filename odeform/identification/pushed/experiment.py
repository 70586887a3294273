"""The next experiment: which push of a body would narrow most what is still open about it.

A push that one makes has a known place and force. What it would tell is its Fisher information about the body at the
estimate; the posterior after it follows from that before it (Bayesian linear design, Chaloner & Verdinelli 1995).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.identification.discrepancy import TWO_SIDED
from odeform.identification.pushed.evidence import Known
from odeform.identification.pushed.forward import BODY_STEP, Forward
from odeform.identification.pushed.search import Problem, information_of
from odeform.identification.pushed.state import BODY, PushState
from odeform.identification.pushed.views import points_of
from odeform.simulation.contact_draws import contact_draws
from odeform.types import Floats, Times

__all__ = ["Candidates", "candidates", "until_halved", "widest"]

COUNT = 32
Covariance = Float[np.ndarray, "body body"]


@dataclass(frozen=True, eq=False)
class Candidates:
    """Pushes that could be made next, and what each would tell."""

    states: Sequence[PushState]
    informations: Float[np.ndarray, "pushes body body"]
    """About `BODY`, in halves of their ranges."""

    def after(self, covariance: Covariance, index: int) -> Covariance:
        """Computes the covariance of the body after push `index`, from that before it."""
        return np.linalg.inv(np.linalg.inv(covariance) + self.informations[index])

    def best(self, covariance: Covariance) -> int:
        """Returns the push after which the widest interval of the body is expected to be narrowest."""
        return int(np.argmin([widest(self.after(covariance, index)) for index in range(len(self.informations))]))


def widest(covariance: Covariance) -> float:
    """Half the width of the widest 90 % interval, in halves of its range."""
    return TWO_SIDED * float(np.sqrt(np.diag(covariance).max()))


def candidates(
    forward: Forward, body: Floats, forces: tuple[float, float], noise_mm: float, errors_mm: Times, seed: int = 0
) -> Candidates:
    """Draws pushes of the body (3,), of the weakest to the strongest of `forces` in newton, and solves what they tell.

    Each is observed at points of the surface with `noise_mm`, by a model that is wrong by `errors_mm` (T,).
    """
    drawn = contact_draws(forward.model.rest, forces, COUNT, [seed, 2])
    states = [forward.state(contact, force, body, forces[1]) for contact, force in drawn]
    inward = [-BODY_STEP if unit + BODY_STEP > 1.0 else BODY_STEP for unit in body]
    bodies = [body, *(body + np.diag(inward))]
    states = [state for state in states if all(_fits(forward, replace(state, body=each)) for each in bodies)]
    if not states:
        raise InputError("identify: no push of this body was found")
    base = forward.motions(states)
    slopes = []
    for index, step in enumerate(inward):
        ahead = body + step * np.eye(len(BODY))[index]
        slopes.append((forward.motions([replace(state, body=ahead) for state in states]) - base) / step)
    informations = []
    for row, changes in zip(base, np.stack(slopes, axis=1), strict=True):
        evidence: Known = points_of(forward.times, row, forward.model.rest.faces, noise_mm)
        problem = Problem(forward, evidence, errors_mm, tuple(range(len(BODY))))
        informations.append(information_of(problem, evidence.compared(row, changes, states[0].camera))[0])
    return Candidates(states, np.stack(informations))


def _fits(forward: Forward, state: PushState) -> bool:
    try:
        forward.check(state)
    except InputError:
        return False
    return True


def until_halved(found: Candidates, covariance: Covariance, order: Sequence[int] | None, most: int = 20) -> int:
    """Counts the pushes until the interval that is widest is half as wide: in that `order`, or the best each time."""
    name = int(np.argmax(np.diag(covariance)))
    wanted, now = 0.25 * covariance[name, name], covariance
    for count in range(1, most + 1):
        index = found.best(now) if order is None else order[count - 1]
        now = found.after(now, index)
        if now[name, name] <= wanted:
            return count
    return most
