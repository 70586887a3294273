"""A model that was refined for a user's own body, which moves the shape that the body was made of."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.modal.model import ModalModel
from odeform.models.modal.user_body import UserBody
from odeform.models.modal.user_part import item_in
from odeform.models.per_object import PerObject
from odeform.simulation.objects.soft_object import SoftObject
from odeform.types import Mesh

__all__ = ["TaughtBodyPredictor", "item_of", "taught"]

SAME = 1e-6  # m, by which nodes of the same body may differ: files round them


def item_of(predictor: Predictor, parameters: Mapping[str, Any]) -> SoftObject | None:
    """The soft object that a model was refined for; None if it is one of a scene's own. `InputError` for a damaged
    checkpoint."""
    checkpoint = predictor.model_of(parameters).checkpoint
    try:
        return item_in(checkpoint.arrays, checkpoint.config)
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(f"checkpoint of {predictor.model}: missing or wrong {error}") from None


def taught(predictor: Predictor, body: UserBody) -> bool:
    """Whether a model was refined for that very body, of the same material."""
    return _part_for(predictor, body) is not None


def _part_for(predictor: Predictor, body: UserBody) -> ModalModel | None:
    for part in predictor.parts.values() if isinstance(predictor, PerObject) else ():
        item = item_of(part, {})
        if isinstance(part, ModalModel) and item is not None and _same(item, body.item):
            return part
    return None


def _same(one: SoftObject, other: SoftObject) -> bool:
    return (
        one.points.shape == other.points.shape
        and bool(np.abs(one.points - other.points).max() < SAME)
        and replace(one.material, source="") == replace(other.material, source="")
    )


class TaughtBodyPredictor(ModalModel):
    """Moves a shape as what was refined for its body says.

    Parameters name the object that the body is like, as those of a body that was not trained do.
    """

    def __init__(self, whole: Predictor, user_body: UserBody) -> None:
        """`InputError` for a model that `taught` is false for."""
        part = _part_for(whole, user_body)
        if part is None:
            raise InputError(f"{whole.model}: was not taught {user_body.item.name}")
        self.whole, self.user_body = whole, user_body
        checkpoint = part.checkpoint
        names = dict.fromkeys((user_body.like, *checkpoint.schema.objects))
        # errors on validation motions are those of the only object
        measured = {k: a for k, a in whole.checkpoint.arrays.items() if k.startswith(("val.", "trained."))}
        super().__init__(
            replace(
                checkpoint,
                schema=replace(checkpoint.schema, objects=tuple(names)),
                arrays={**checkpoint.arrays, **measured},
            )
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return TaughtBodyPredictor, (self.whole, self.user_body)

    def under(self, load: str) -> Predictor:
        return TaughtBodyPredictor(self.whole.under(load), self.user_body)

    @property
    def bodies(self) -> tuple[Mesh, ...]:
        shape = self.user_body.fit.geometry
        return (self.rest, shape) if isinstance(shape, Mesh) else (self.rest,)
