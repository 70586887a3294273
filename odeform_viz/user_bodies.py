"""Shapes of the user's own as soft bodies, in scenes in which a sphere pushes."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.models.base import Predictor
from odeform.models.modal.user_body import UserBody, UserBodyPredictor, takes_user_bodies, user_body
from odeform.simulation.objects.materials import material_of
from odeform_viz.columns import Column
from odeform_viz.fitting import readable_shape

__all__ = [
    "UserBody",
    "UserBodyPredictor",
    "describe_user_body",
    "read_user_body",
    "takes_user_bodies",
    "user_body_of",
    "with_user_body",
    "without_user_body",
]


def read_user_body(name: str | Path, material: str | None = None) -> UserBody:
    """The body of a file; see `odeform.models.modal.user_body.user_body`, and `material_of` for its material.

    `InputError` for a file without one.
    """
    geometry, _ = readable_shape(name)
    given = None if material is None else material_of(material)
    body = user_body(geometry, Path(name).name, material=given)
    return replace(body, fit=replace(body.fit, origin=str(name)))


def describe_user_body(body: UserBody) -> str:
    """Returns one line: points, size, weight and material, and what was done to make a solid of it."""
    size = 1e3 * float(np.ptp(body.item.settled, axis=0).max())
    points = len(body.fit.geometry.points)
    return (
        f"{body.item.name}: {points:,} points move with a soft body of {body.item.surface_count:,} surface vertices, "
        f"{size:.0f} mm long and {1e3 * body.item.mass:,.0f} g, {body.made}"
    )


def user_body_of(predictor: Predictor | None) -> UserBody | None:
    """The user's own body that a model moves; None for trained bodies."""
    return predictor.user_body if isinstance(predictor, UserBodyPredictor) else None


def with_user_body(columns: Sequence[Column], body: UserBody) -> list[Column]:
    """The columns with another body: those of models that know only trained bodies are hidden, as are truths."""
    return [_moved(column, body) for column in columns]


def _moved(column: Column, body: UserBody) -> Column:
    predictor = column.predictor
    if predictor is None or column.pinned is not None:
        return replace(column, visible=column.visible and predictor is not None)
    if not takes_user_bodies(predictor):
        return replace(column, visible=False)
    return replace(column, source=UserBodyPredictor(predictor, body), geometry=body.fit.geometry, fit=body.fit)


def without_user_body(columns: Sequence[Column]) -> list[Column]:
    """The columns with trained bodies again; truths are hidden."""
    return [_trained(column) for column in columns]


def _trained(column: Column) -> Column:
    predictor = column.predictor
    if not isinstance(predictor, UserBodyPredictor):
        return replace(column, visible=column.visible and predictor is not None)
    return replace(column, source=predictor.trained, geometry=predictor.trained.rest, fit=None)
