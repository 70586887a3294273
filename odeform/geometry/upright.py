"""Finds which axis of a shape points up: what its file says, else for a mesh a guess, else z.

The viewer, the command line and `fit_to` follow this one rule.
"""

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.types import Floats, Geometry, Mesh, Rotations

__all__ = ["guess_up", "stand_up", "up_axis", "up_of_rotation"]

NEAR = 0.03  # of the height; points this close to the lowest one stand on the floor
CLEARLY = 1.3  # times as well as on z


def up_axis(geometry: Geometry) -> tuple[str, str]:
    """The axis of a shape that points up, as "+y", and why, if it is not z."""
    if geometry.up not in ("", "+z"):
        return geometry.up, f"{geometry.up.lstrip('+')} is up, as the file's format specifies"
    if not geometry.up and isinstance(geometry, Mesh) and guess_up(geometry) == "+y":
        return "+y", "**y was taken for up**, a guess: the shape stands better on it"
    return "+z", ""


def stand_up(geometry: Geometry) -> Geometry:
    """A shape whose file says that another axis than z is up, turned so that z is; every other one as it is."""
    return geometry if geometry.up in ("", "+z") else Similarity(rotation=UPRIGHT[geometry.up]).shape(geometry)


def up_of_rotation(rotation: Rotations) -> str:
    """The signed axis that a rotation (3, 3) turns nearest to +z, as "+y"."""
    axis = int(np.abs(rotation[2]).argmax())
    return ("-" if rotation[2, axis] < 0.0 else "+") + "xyz"[axis]


def guess_up(mesh: Mesh) -> str:
    """ "+y" where a mesh clearly stands better on y than on z, else "+z".

    A shape stands well if the hull of its lowest points covers much of its footprint: feet, a sole, a base.
    """
    points = np.asarray(mesh.points, dtype=float)
    return "+y" if _stand(points, 1) > CLEARLY * _stand(points, 2) else "+z"


def _stand(points: Floats, up: int) -> float:
    """Fraction of the bounding rectangle from above that the hull of the lowest points covers."""
    height, across = points[:, up], np.delete(points, up, axis=1)
    footprint = float(np.prod(np.ptp(across, axis=0)))
    low = across[height <= height.min() + NEAR * np.ptp(height)]
    if len(low) < 3 or footprint <= 0.0:
        return 0.0
    try:
        return float(ConvexHull(low).volume) / footprint  # the "volume" of a plane hull is its area
    except QhullError:
        return 0.0
