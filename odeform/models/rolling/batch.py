"""The field of many rolling bodies at once."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from odeform.mechanics.rolling.dynamics import RollingDynamics
from odeform.motion.reduced_space import POSE
from odeform.solver.batch_steps import BatchField
from odeform.types import Floats, Ints

__all__ = ["batch_field"]


def batch_field(
    dynamics: Callable[[Float[np.ndarray, "rows materials"]], RollingDynamics],
    material: Float[np.ndarray, "batch materials"],
    units: Floats,
) -> BatchField:
    """Fields of bodies of `material` (B, Q), whose `dynamics` are those of some of them, as `make_field` has each."""
    known: tuple[Ints, RollingDynamics] | None = None

    def field(rows: Ints, times: Floats, states: Floats) -> Floats:
        nonlocal known
        if known is None or known[0] is not rows:
            known = rows, dynamics(material[rows])
        plain = states.astype(float) / units
        lost = ~np.isfinite(plain[:, 1:POSE].sum(axis=1))
        plain[lost] = 0.0
        slopes = known[1].slopes(plain.T).T * units
        slopes[lost] = np.nan  # the integration ends there, with a status
        return slopes.astype(states.dtype)

    return field
