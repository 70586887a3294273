"""Another shape than the body that was trained: read, limited, fitted, and what the user is told of it."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.formats.bundled import read_shape
from odeform.geometry.parts import most_visible
from odeform.geometry.region import region_from_json, region_to_json
from odeform.geometry.shape import FittedShape, fit_to, mean_distance
from odeform.geometry.similarity import Similarity
from odeform.types import GaussianSplats, Mesh

__all__ = ["MOST_POINTS", "describe_fit", "fit_from_json", "fit_to_json", "shape_from"]

MOST_POINTS = 200_000  # what is moved and sent at interactive rates
ALIKE = 0.05  # of the body's size; shapes that lie closer are the body in another discretisation


def shape_from(name: str | Path, body: Mesh, transform: Similarity | None = None) -> FittedShape:
    """Read a file or a bundled shape and fit it to the body, or place it by `transform`. Of many splats the most
    visible are kept.

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
    return replace(fit_to(geometry, body, region, transform=transform), origin=str(name))


def fit_to_json(fit: FittedShape) -> dict[str, Any]:
    """Where a shape comes from, what moves of it and how it lies, in plain values."""
    region = None if fit.region is None else region_to_json(fit.region)
    file = Path(fit.origin)
    origin = str(file.resolve()) if file.is_file() else fit.origin
    return {"origin": origin, "region": region, "place": fit.transform.to_json()}


def fit_from_json(raw: Mapping[str, Any], body: Mesh) -> FittedShape:
    """The shape read again, in the same part and place. `InputError` where that cannot be."""
    fit = shape_from(str(raw["origin"]), body)
    region = None if raw["region"] is None else region_from_json(raw["region"])
    return replace(fit_to(fit.source, body, region, transform=Similarity.from_json(raw["place"])), origin=fit.origin)


def describe_fit(fit: FittedShape, name: str, body: Mesh) -> str:
    """Size, factor, what was wrong with the file, and by how much the shape differs from what was trained."""
    size = float(np.ptp(body.points, axis=0).max())
    off = mean_distance(fit.geometry, body)
    text = f"{Path(name).name}: {len(fit.geometry.points):,} points"
    if fit.remainder is not None:
        text += f" move, {len(fit.remainder.points):,} stand still"
    text += f", scaled by {fit.transform.factor:.4g} to the trained size"
    if off > ALIKE * size:
        text += f"; its surface lies {1e3 * off:.0f} mm from the trained body's on average: no such shape was trained"
    return "; ".join([text, *(fit.source.notes if isinstance(fit.source, GaussianSplats) else ())])
