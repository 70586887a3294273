"""Another shape than the body that was trained: read, limited, fitted, and what the user is told of it."""

from pathlib import Path

import numpy as np

from odeform.errors import InputError
from odeform.geometry.bundled import read_shape
from odeform.geometry.parts import most_visible
from odeform.geometry.shape import Fit, difference, fit_to
from odeform.types import GaussianSplats, Mesh

__all__ = ["MOST_POINTS", "describe_fit", "shape_from"]

MOST_POINTS = 200_000  # what is moved and sent at interactive rates
ALIKE = 0.05  # of the body's size; shapes that lie closer are the body in another discretisation


def shape_from(name: str | Path, body: Mesh) -> Fit:
    """The shape of a file, or the bundled one of that name, fitted to the body; of many splats the most visible.

    `InputError` for what cannot be read or is too large to be shown.
    """
    geometry, region = read_shape(name)
    if isinstance(geometry, GaussianSplats):
        geometry = most_visible(geometry, MOST_POINTS)
    if len(geometry.points) > MOST_POINTS:
        raise InputError(
            f"geometry {Path(name).name}: {len(geometry.points):,} points; expected at most {MOST_POINTS:,}, which can "
            "be shown moving: decimate it first"
        )
    return fit_to(geometry, body, region)


def describe_fit(fit: Fit, name: str, body: Mesh) -> str:
    """Size, factor, what was wrong with the file, and by how much the shape differs from what was trained."""
    size = float(np.ptp(body.points, axis=0).max())
    off = difference(fit.geometry, body)
    text = f"{Path(name).name}: {len(fit.geometry.points):,} points"
    if fit.left is not None:
        text += f" move, {len(fit.left.points):,} stand still"
    text += f", scaled by {fit.place.factor:.4g} to the trained size"
    if off > ALIKE * size:
        text += f"; its surface lies {1e3 * off:.0f} mm from the trained body's on average: no such shape was trained"
    return "; ".join([text, *(fit.source.notes if isinstance(fit.source, GaussianSplats) else ())])
