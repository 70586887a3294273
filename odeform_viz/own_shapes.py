"""Shapes of the user's own as soft bodies, in scenes in which a sphere pushes."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.models.base import Predictor
from odeform.models.modal.user_body import UserBody, UserBodyPredictor, takes_user_bodies, user_body
from odeform_viz.columns import Column
from odeform_viz.fitting import readable_shape

__all__ = [
    "UserBody",
    "UserBodyPredictor",
    "describe_own_body",
    "own_of",
    "read_own_body",
    "takes_user_bodies",
    "with_own_body",
    "without_own_body",
]


def read_own_body(name: str | Path) -> UserBody:
    """The body of a file; see `odeform.models.modal.user_body.user_body`. `InputError` for a file without one."""
    geometry, _ = readable_shape(name)
    own = user_body(geometry, Path(name).name)
    return replace(own, fit=replace(own.fit, origin=str(name)))


def describe_own_body(own: UserBody) -> str:
    """One line: points, size and material."""
    size = 1e3 * float(np.ptp(own.item.settled, axis=0).max())
    points = len(own.fit.geometry.points)
    return (
        f"{own.item.name}: {points:,} points move with a soft body of {own.item.surface_count:,} surface vertices, "
        f"{size:.0f} mm long, of the {own.like}'s material"
    )


def own_of(predictor: Predictor | None) -> UserBody | None:
    """The user's own body that a model moves; None for trained bodies."""
    return predictor.own if isinstance(predictor, UserBodyPredictor) else None


def with_own_body(columns: Sequence[Column], own: UserBody) -> list[Column]:
    """The columns with another body: those of models that know only trained bodies are hidden, as are truths."""
    return [_moved(column, own) for column in columns]


def _moved(column: Column, own: UserBody) -> Column:
    predictor = column.predictor
    if predictor is None or column.pinned is not None:
        return replace(column, visible=column.visible and predictor is not None)
    if not takes_user_bodies(predictor):
        return replace(column, visible=False)
    return replace(column, source=UserBodyPredictor(predictor, own), geometry=own.fit.geometry, fit=own.fit)


def without_own_body(columns: Sequence[Column]) -> list[Column]:
    """The columns with trained bodies again; truths are hidden."""
    return [_trained(column) for column in columns]


def _trained(column: Column) -> Column:
    predictor = column.predictor
    if not isinstance(predictor, UserBodyPredictor):
        return replace(column, visible=column.visible and predictor is not None)
    return replace(column, source=predictor.trained, geometry=predictor.trained.rest, fit=None)
