"""Which axis of a shape points up."""

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from odeform.types import Floats, Mesh

__all__ = ["guess_up"]

NEAR = 0.03  # of the height; points this close to the lowest one stand on the floor
CLEARLY = 1.3  # times as well as on z


def guess_up(mesh: Mesh) -> str:
    """ "+y" where a mesh clearly stands better on y than on z, else "+z".

    A shape stands well if the hull of its lowest points covers much of its footprint: feet, a sole, a base.
    """
    points = np.asarray(mesh.points, dtype=float)
    return "+y" if _stand(points, 1) > CLEARLY * _stand(points, 2) else "+z"


def _stand(points: Floats, up: int) -> float:
    """Share of the bounding rectangle from above that the hull of the lowest points covers."""
    height, across = points[:, up], np.delete(points, up, axis=1)
    footprint = float(np.prod(np.ptp(across, axis=0)))
    low = across[height <= height.min() + NEAR * np.ptp(height)]
    if len(low) < 3 or footprint <= 0.0:
        return 0.0
    try:
        return float(ConvexHull(low).volume) / footprint  # the "volume" of a plane hull is its area
    except QhullError:
        return 0.0
