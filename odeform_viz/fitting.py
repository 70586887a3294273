"""Loaded shapes: reading one, fitting it to the trained body, and describing the fit."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from odeform.errors import InputError
from odeform.formats.bundled import read_shape
from odeform.geometry.parts import most_visible
from odeform.geometry.region import Region, region_from_json, region_to_json
from odeform.geometry.shape import FittedShape, fit_to
from odeform.geometry.shape_similarity import ShapeSimilarity
from odeform.geometry.similarity import Similarity
from odeform.types import GaussianSplats, Geometry, Mesh

__all__ = ["MOST_POINTS", "describe_fit", "fit_from_json", "fit_to_json", "readable_shape", "shape_from"]

MOST_POINTS = 200_000  # that can be deformed and sent at interactive rates


def readable_shape(name: str | Path) -> tuple[Geometry, Region | None]:
    """Read a file or a bundled shape, and the part of it that moves.

    Gaussian splats are reduced to the most visible `MOST_POINTS`. `InputError` for a file that cannot be read, or has
    too many points.
    """
    geometry, region = read_shape(name)
    if isinstance(geometry, GaussianSplats):
        geometry = most_visible(geometry, MOST_POINTS)
    if len(geometry.points) > MOST_POINTS:
        raise InputError(
            f"geometry {Path(name).name}: {len(geometry.points):,} points; expected at most {MOST_POINTS:,}, which can "
            "be shown moving: decimate it first"
        )
    return geometry, region


def shape_from(name: str | Path, body: Mesh, transform: Similarity | None = None) -> FittedShape:
    """Read a shape (`readable_shape`), and fit it to the body, or place it by `transform`."""
    geometry, region = readable_shape(name)
    return replace(fit_to(geometry, body, region, transform=transform), origin=str(name))


def fit_to_json(fit: FittedShape) -> dict[str, Any]:
    """Returns the origin, moving part and transform of a shape, as plain values."""
    region = None if fit.region is None else region_to_json(fit.region)
    file = Path(fit.origin)
    origin = str(file.resolve()) if file.is_file() else fit.origin
    return {"origin": origin, "region": region, "place": fit.transform.to_json()}


def fit_from_json(raw: Mapping[str, Any], body: Mesh) -> FittedShape:
    """Read the shape again, with the same part and transform. `InputError` where that is impossible."""
    fit = shape_from(str(raw["origin"]), body)
    region = None if raw["region"] is None else region_from_json(raw["region"])
    return replace(fit_to(fit.source, body, region, transform=Similarity.from_json(raw["place"])), origin=fit.origin)


def describe_fit(fit: FittedShape, name: str, similarity: ShapeSimilarity | None) -> str:
    """One line: points, scale, how similar the shape is to the trained body, if that is known, and notes of the
    reader."""
    text = f"{Path(name).name}: {len(fit.geometry.points):,} points"
    if fit.remainder is not None:
        text += f" move, {len(fit.remainder.points):,} stand still"
    text += f", scaled by {fit.transform.factor:.4g} to the trained size"
    if fit.upright:
        text += f"; {fit.upright}"
    if similarity is not None:
        text += f"; {similarity.describe()}"
    return "; ".join([text, *fit.source.notes])
