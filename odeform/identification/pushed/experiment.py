"""The next experiment: a push, a drop or a throw that would narrow most what is still open about a body.

An experiment that one makes has known parameters. What it would tell is its Fisher information about the body at the
estimate; the posterior after it follows from that before it (Bayesian linear design, Chaloner & Verdinelli 1995).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.identification.discrepancy import TWO_SIDED

__all__ = ["Candidates", "Experiment", "until_halved", "widest"]

MOST = 20
"""Experiments that are counted."""
Covariance = Float[np.ndarray, "body body"]


@dataclass(frozen=True, eq=False)
class Experiment:
    """Something that one can do to the body."""

    load: str
    """What happens: "push", or the name of a load."""
    parameters: Mapping[str, Any]
    """Those of its scene, with the mass and stiffness of the body as they are estimated."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Experiments that could be made next, and what each would tell."""

    experiments: Sequence[Experiment]
    informations: Float[np.ndarray, "experiments body body"]
    """About `BODY`, in halves of their ranges."""

    def after(self, covariance: Covariance, index: int) -> Covariance:
        """Computes the covariance of the body after experiment `index`, from that before it."""
        return np.linalg.inv(np.linalg.inv(covariance) + self.informations[index])

    def best(self, covariance: Covariance) -> int:
        """Returns the experiment after which the widest interval of the body is expected to be narrowest."""
        return int(np.argmin([widest(self.after(covariance, index)) for index in range(len(self.informations))]))

    def under(self, load: str) -> "Candidates":
        """Those under one load."""
        kept = [index for index, one in enumerate(self.experiments) if one.load == load]
        return Candidates([self.experiments[index] for index in kept], self.informations[kept])


def widest(covariance: Covariance) -> float:
    """Half the width of the widest 90 % interval, in halves of its range."""
    return TWO_SIDED * float(np.sqrt(np.diag(covariance).max()))


def until_halved(found: Candidates, covariance: Covariance, order: Sequence[int] | None = None) -> list[int]:
    """Lists experiments until the interval that is widest is half as wide, or `MOST`: in that `order`, or the best each
    time."""
    name = int(np.argmax(np.diag(covariance)))
    wanted, now, made = 0.25 * covariance[name, name], covariance, list[int]()
    most = MOST if order is None else min(MOST, len(order))
    while now[name, name] > wanted and len(made) < most:
        made.append(found.best(now) if order is None else order[len(made)])
        now = found.after(now, made[-1])
    return made
