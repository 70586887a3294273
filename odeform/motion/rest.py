"""When a body has come to rest."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from odeform.motion.base import Motion
    from odeform.motion.recorded import RecordedMotion

__all__ = ["rests_from"]

STILL = 1e-3  # m that a body may still move
STEP, LAST = 0.01, 0.05  # s between the times that are looked at; and at the end, in which a body cannot come to rest


def rests_from(motion: "Motion | RecordedMotion", until: float) -> float | None:
    """Seconds from which on the box around the body moves by less than a millimetre, and its RMS deformation changes by
    less, to within 10 ms; None where it still moves just before `until` seconds.

    It takes as long for a scan of a million points as for a few.
    """
    times = np.arange(0.0, until + 0.5 * STEP, STEP)
    points = np.asarray(motion.geometry.points, dtype=float)
    ends = np.stack([points.min(axis=0), points.max(axis=0)], axis=1)
    corners = np.stack(np.meshgrid(*ends), axis=-1).reshape(-1, 3)
    pose, deformation = motion.pose(times), motion.deformation_rms(times)
    places = corners @ pose[:, :3, :3].swapaxes(1, 2) + pose[:, None, :3, 3]
    away = np.sqrt(np.square(places - places[-1]).sum(axis=2)).max(axis=1)
    moving = np.flatnonzero(np.maximum(away, np.abs(deformation - deformation[-1])) > STILL)
    first = int(moving[-1]) + 1 if len(moving) else 0
    # a body that passes its last place just then has not come to rest
    return float(times[first]) if first < len(times) - round(LAST / STEP) else None
