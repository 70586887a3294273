"""When a body has come to rest."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from odeform.motion.base import Motion

__all__ = ["rests_from"]

STILL = 1e-3  # m that points may still move
STEP = 0.01  # s
POINTS = 200


def rests_from(motion: "Motion", until: float) -> float | None:
    """Seconds from which on no point of the body moves by more than a millimetre, to within 10 ms; None where one still
    does just before `until` seconds."""
    times = np.arange(0.0, until + 0.5 * STEP, STEP)
    points = motion.vertices(times)
    points = points[:, :: max(points.shape[1] // POINTS, 1)]
    farthest = np.sqrt(np.square(points - points[-1]).sum(axis=2)).max(axis=1)
    moving = np.flatnonzero(farthest > STILL)
    first = int(moving[-1]) + 1 if len(moving) else 0
    # a body that passes its last place just then has not come to rest
    return float(times[first]) if first < len(times) - round(0.05 / STEP) else None
