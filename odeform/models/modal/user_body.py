"""The mechanical model of a body that it was not trained on: a mesh, points or splats of the user's own."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree
from threadpoolctl import threadpool_limits

from odeform.errors import InputError
from odeform.geometry.rigid import best_rigid
from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import Similarity
from odeform.models.base import Predictor
from odeform.models.modal.body_parameters import schema_of
from odeform.models.modal.elastic_body import ElasticBody, elastic_body
from odeform.models.modal.model import ModalModel
from odeform.models.modal.shape_band import SHAPE_BAND, ShapeBand
from odeform.models.modal.transferred_residual import shape_distance, transfer_weight, transferred_residual
from odeform.models.modal.user_part import forces_in
from odeform.models.per_object import PerObject
from odeform.motion.validity import Validity
from odeform.schema import OBJECT, Parameters
from odeform.simulation.objects.soft_object import SoftMaterial, SoftObject
from odeform.types import Floats, Geometry, Mesh, Points, Times

__all__ = ["UserBody", "UserBodyPredictor", "resting_body", "takes_user_bodies", "user_body"]

ALONE = threadpool_limits.wrap(limits=1, user_api="blas")
"""Products here are small: two threads that wait for each other took three times as long on a busy machine."""
NEIGHBOURS = 4  # nodes that carry a point of the shape


@dataclass(frozen=True, eq=False)
class UserBody:
    """A shape as a soft body that rests on the floor."""

    item: SoftObject
    body: ElasticBody
    like: str
    """The trained object whose contact parameters it has."""
    fit: FittedShape
    """The shape as it was given, placed where the body rests."""
    made: str = ""
    """How it was made, in one line: the material, and what a solid has that the shape does not have."""


@ALONE
def user_body(
    geometry: Geometry, name: str = "shape", up: str | None = None, material: SoftMaterial | None = None
) -> UserBody:
    """Make a soft body of a shape: a mesh with any defects, or points or splats that outline a solid.

    It takes about five seconds. `up` is the axis of the shape that points up, as "+y"; by default what its file says,
    else a guess. `material` is by default the softest of those to choose from under which it stands.

    Raises:
        InputError: for a shape that encloses no volume, holds several bodies, or does not stand.
    """
    from odeform.simulation.objects.from_mesh import placed_object  # looking at trained bodies needs no simulator

    try:
        placed = placed_object(geometry, name, up=up, material=material)
    except InputError as error:
        raise InputError(f"{name}: {str(error).removeprefix(f'{name}: ')}") from None
    item = placed.item
    weights = np.full(item.surface_count, 1.0 / item.surface_count)
    free, settled = (nodes[: item.surface_count] for nodes in (item.points, item.settled))
    turn, shift = best_rigid(free, settled, weights)
    laying = Similarity(1.0, turn, weights @ free + shift - turn @ (weights @ free))
    laid = laying @ placed.transform
    shape, stiff = laid.shape(geometry), laying.points(item.points)
    sagging = _carried(item.settled - stiff, stiff, np.asarray(shape.points, dtype=float))
    shape = replace(shape, points=(shape.points + sagging).astype(np.float32))
    fit = FittedShape(geometry, None, laid, shape, None, 0.0)
    return UserBody(item, elastic_body(item), placed.like, fit, placed.describe())


def resting_body(item: SoftObject, like: str) -> UserBody:
    """A soft object as it rests on the floor, whose shape is its own surface."""
    rest = item.rest_mesh()
    return UserBody(item, elastic_body(item), like, FittedShape(rest, None, Similarity(), rest, None, 0.0))


def _carried(
    values: Float[np.ndarray, "nodes 3"], nodes: Float[np.ndarray, "nodes 3"], points: Points
) -> Float[np.ndarray, "points 3"]:
    """The values at the nodes, carried to points."""
    away, near = KDTree(nodes).query(points, NEIGHBOURS)
    weights = 1.0 / np.maximum(away, 1e-9)
    return np.einsum("nk,nki->ni", weights / weights.sum(axis=1, keepdims=True), values[near])


def takes_user_bodies(predictor: Predictor) -> bool:
    """Whether a model computes bodies that it was not trained on from their shape and material."""
    return _part_of(predictor) is not None


def _part_of(predictor: Predictor, like: str = "") -> ModalModel | None:
    """The part for one object, the first if there is none for it; None for other models."""
    if isinstance(predictor, PerObject):
        found = predictor.parts.get(like, next(iter(predictor.parts.values())))
        return found if isinstance(found, ModalModel) else None
    return predictor if isinstance(predictor, ModalModel) else None


def _largest(part: ModalModel, user_body: UserBody) -> list[float]:
    """m: the largest shift and deformation that motions of a body are bounded by, softly.

    At least those of the trained body. A lighter one may fly as far as the strongest pulse throws it, a larger one may
    deform more.
    """
    shift, deformation = part.checkpoint.config["largest"]
    solid, window = user_body.body.solid, part.schema.window
    thrown = user_body.item.forces[1] * part.pulse / solid.mass * window.stop
    sizes = [float(np.ptp(body.points, axis=0).max()) for body in (user_body.body, part.body)]
    return [max(shift, thrown), deformation * max(sizes[0] / sizes[1], 1.0)]


class UserBodyPredictor(ModalModel):
    """The fitted contact parameters of a trained model, with the modes of another body.

    Attributes:
        distance: How far the body is from the trained one that it is like, relative to that one's size: see
            `odeform.models.modal.transferred_residual.shape_distance`.
    """

    @ALONE
    def __init__(self, trained: Predictor, user_body: UserBody) -> None:
        """`InputError` for a model that `takes_user_bodies` is false for."""
        trained = trained.trained if isinstance(trained, UserBodyPredictor) else trained
        part = _part_of(trained, user_body.like)
        if part is None:
            raise InputError(f"{trained.model}: knows its trained bodies only; expected a mechanical model")
        self.trained, self.user_body = trained, user_body
        body, checkpoint = user_body.body, part.checkpoint
        self.distance = shape_distance(Mesh(body.points.astype(np.float32), body.faces), part.rest)
        # a residual is that of the trained body: what similar shapes get of it is added below; and so are solver
        # errors, which were not measured on this one
        of_trained = ("correction", "qualities", "frontier")
        kept = {key: value for key, value in checkpoint.config.items() if key not in of_trained}
        super().__init__(
            replace(
                checkpoint,
                schema=schema_of([user_body.item], trained.schema) if part.own_values else trained.schema,
                config={
                    **kept,
                    "body": body.to_json(),
                    "largest": _largest(part, user_body),
                    "young_kpa": 1e-3 * user_body.item.material.young,
                },
                arrays={**body.shown(), **body.arrays()},
            )
        )
        if part.residual is not None:
            self.residual = transferred_residual(part, body, self._coordinates[1], transfer_weight(self.distance))
        band = trained.checkpoint.config.get(SHAPE_BAND)
        self._band = None if band is None else ShapeBand.from_json(band)
        self.knows_untrained_errors = self._band is not None

    def __reduce__(self) -> tuple[Any, ...]:
        return UserBodyPredictor, (self.trained, self.user_body)

    def under(self, load: str) -> Predictor:
        return UserBodyPredictor(self.trained.under(load), self.user_body)

    def force_range(self, parameters: Mapping[str, Any]) -> tuple[float, float]:
        return forces_in(self.user_body.item, self.rest, parameters, self.load)

    @cached_property
    def validity(self) -> Validity:
        return replace(super().validity, untrained=f"{self.describe_motion()}, {self.describe_error()}")

    def describe_motion(self) -> str:
        """Says what decides the motion of the body, as the start of a sentence in lower case."""
        return f"its motion follows from its shape, its material, and the {self.user_body.like}'s contact parameters"

    def describe_error(self) -> str:
        """Says what is known of its error: on how many other shapes it was measured, and how far this one is away."""
        if self._band is None:
            return "with an unknown error"
        away = 100.0 * self.distance
        return f"with an error {self._band.describe()}; it is {away:.1f} % from the {self.user_body.like}"

    @property
    def bodies(self) -> tuple[Mesh, ...]:
        return self.trained.bodies

    def error_band(
        self, parameters: Parameters, times: Times, size: Callable[[], float] | None = None
    ) -> Floats | None:
        """(T, 2) mm at `times` (T,) s, as that of trained bodies, from errors on other shapes that were not trained: it
        widens with `distance`. None where the checkpoint has no such errors."""
        if self._band is None or self.is_changed(parameters):
            return None
        given = self.complete({**self.parameters_like(), **parameters})
        return self._band.at(size() if size else self.size_mm(given), self.distance, times)

    def rest_of(self, parameters: Mapping[str, Any]) -> Mesh:
        return self.rest

    def parameters_like(self) -> dict[str, str]:
        """The object to name in parameters: the one that the body is like, if it was trained."""
        return {OBJECT: self.user_body.like} if self.user_body.like in self.schema.objects else {}
