"""Shapes of the user's own as soft bodies, in scenes in which a sphere pushes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from odeform.formats.bundled import moving_part
from odeform.geometry.carried_colors import colored_like
from odeform.models.base import Predictor
from odeform.models.modal.taught_body import TaughtBodyPredictor, item_of, taught
from odeform.models.modal.user_body import UserBody, UserBodyPredictor, takes_user_bodies, user_body
from odeform.simulation.objects.materials import material_of
from odeform.simulation.objects.soft_object import SoftObject
from odeform.types import Mesh
from odeform_viz.columns import Column
from odeform_viz.fitting import readable_shape

__all__ = [
    "TaughtBodyPredictor",
    "UserBody",
    "UserBodyPredictor",
    "describe_user_body",
    "read_user_body",
    "refined_column",
    "simulated_item",
    "takes_user_bodies",
    "user_body_of",
    "with_own_colors",
    "with_user_body",
    "without_user_body",
]


def read_user_body(name: str | Path, material: str | None = None) -> UserBody:
    """The body of a file; see `odeform.models.modal.user_body.user_body`, and `material_of` for its material.

    `InputError` for a file without one.
    """
    geometry = moving_part(*readable_shape(name))
    given = None if material is None else material_of(material)
    body = user_body(geometry, Path(name).name, material=given)
    return replace(body, fit=replace(body.fit, origin=str(name)))


def describe_user_body(body: UserBody) -> str:
    """Returns one line: points, size, weight and material, and what was done to make a solid of it."""
    size = 1e3 * float(np.ptp(body.item.settled, axis=0).max())
    points = len(body.fit.geometry.points)
    return (
        f"{body.item.name}: {points:,} points move with a soft body of {body.item.surface_count:,} surface vertices, "
        f"{size:.0f} mm long and {1e3 * body.item.mass:,.0f} g, " + "; ".join((body.made, *body.fit.source.notes))
    )


def user_body_of(predictor: Predictor | None) -> UserBody | None:
    """The user's own body that a model moves, taught or not; None for trained bodies."""
    return predictor.user_body if isinstance(predictor, UserBodyPredictor | TaughtBodyPredictor) else None


def with_own_colors(surface: Mesh, predictor: Predictor | None) -> Mesh:
    """The surface that the simulator moves of the user's own body, in the colours of the shape; others as they are."""
    body = user_body_of(predictor)
    same = body is not None and np.array_equal(surface.faces, body.item.faces)
    return colored_like(surface, body.fit.geometry) if same and body is not None else surface


def simulated_item(predictor: Predictor | None, parameters: Mapping[str, Any]) -> SoftObject | None:
    """The soft object that the simulator takes for a body of the user's own, shown as such or taught to the model; None
    for a scene's own objects. `InputError` for a damaged checkpoint."""
    if predictor is None or not takes_user_bodies(predictor):
        return None
    body = user_body_of(predictor)
    return item_of(predictor, predictor.complete(parameters)) if body is None else body.item


def with_user_body(columns: Sequence[Column], body: UserBody) -> list[Column]:
    """The columns with another body: those of models that know only trained bodies are hidden, as are truths. Models
    that were taught another body are left out."""
    return [_moved(column, body) for column in columns if _knows(column, body)]


def _knows(column: Column, body: UserBody) -> bool:
    return not isinstance(column.predictor, TaughtBodyPredictor) or taught(column.predictor.whole, body)


def refined_column(columns: Sequence[Column], label: str, refined: Predictor, origin: str) -> Column:
    """The column of a refined model of the user's body, which the first of the columns shows as a first guess.

    `InputError` for a model that was not taught that body.
    """
    first = next(c for c in columns if user_body_of(c.predictor) is not None and c.pinned is None)
    body = user_body_of(first.predictor)
    assert body is not None
    return replace(first, label=label, source=TaughtBodyPredictor(refined, body), origin=origin, visible=True)


def _moved(column: Column, body: UserBody) -> Column:
    predictor = column.predictor
    if predictor is None or column.pinned is not None:
        return replace(column, visible=column.visible and predictor is not None)
    if not takes_user_bodies(predictor):
        return replace(column, visible=False)
    if isinstance(predictor, TaughtBodyPredictor) or taught(predictor, body):
        whole = predictor.whole if isinstance(predictor, TaughtBodyPredictor) else predictor
        source = TaughtBodyPredictor(whole, body)
    else:
        source = UserBodyPredictor(predictor, body)
    return replace(column, source=source, geometry=source.shown(body.fit.geometry), fit=body.fit)


def without_user_body(columns: Sequence[Column]) -> list[Column]:
    """The columns with trained bodies again; truths are hidden, and models that were taught the body left out."""
    return [_trained(column) for column in columns if not isinstance(column.predictor, TaughtBodyPredictor)]


def _trained(column: Column) -> Column:
    predictor = column.predictor
    if not isinstance(predictor, UserBodyPredictor):
        return replace(column, visible=column.visible and predictor is not None)
    trained = predictor.trained
    return replace(column, source=trained, geometry=trained.shown(trained.rest), fit=None)
