"""The push that precedes the ODE of a rolling body, and how its deformation sets in."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.motion.reduced_space import POSE
from odeform.types import Times

__all__ = ["RISING", "Push", "rising"]

RISING = 0.04
"""s."""


@dataclass(frozen=True, eq=False)
class Push:
    """The motion during the push: from rest to where the ODE begins, with its velocity there; cubic in time."""

    begin: float
    """s."""
    pose: Float[np.ndarray, "*batch 6"]
    rate: Float[np.ndarray, "*batch 6"]
    coordinates: int

    def __call__(self, times: Times) -> Float[np.ndarray, "*batch times y"]:
        """(T,) s from 0 to `begin` -> (T, 6 + S), without deformation; of several pushes, (B, T, 6 + S)."""
        part = (times / self.begin)[:, None]
        pose, rate = self.pose[..., None, :], self.rate[..., None, :]
        out = np.zeros((*self.pose.shape[:-1], len(times), self.coordinates))
        out[..., :POSE] = part**2 * (3.0 - 2.0 * part) * pose + part**2 * (part - 1.0) * self.begin * rate
        return out


def rising(after: Times) -> Times:
    """(T,) s -> (T,) from 0 to 1, in `RISING` seconds: what contacts do to the body takes its place."""
    part = np.minimum(after / RISING, 1.0)
    return part**2 * (3.0 - 2.0 * part)
