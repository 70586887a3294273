"""The errors of one shape: of the model, of it without deformation, of the nearest trained object's motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.geometry.rigid import best_rigid
from odeform.models.base import Predictor
from odeform.models.modal.user_body import UserBodyPredictor
from odeform.types import Floats, Frames, Perpoint, Points
from odeform_figures.unseen.predictions import Predictions, predictions
from odeform_figures.unseen.shapes import UnseenShape

__all__ = ["Measured", "measure"]


@dataclass(frozen=True, eq=False)
class Measured:
    """P pushes of one shape at T frames after the first."""

    shape: UnseenShape
    distance: float
    """Distance from what was trained; see `UserBodyPredictor.distance`."""
    errors: Float[np.ndarray, "pushes times"]
    """mm, RMSE of the model."""
    predicted: Float[np.ndarray, "pushes times"]
    """mm, RMS displacement of the model."""
    within: float | None
    """The fraction of frames within the 90 % band that the model has already; None where it has none."""
    pooled: dict[str, float]
    """mm: see `to_json`."""

    def to_json(self, seen: Mapping[str, Any]) -> dict[str, Any]:
        """Pooled RMSEs in mm of the displacement (`moved_mm`), the model, it without deformation (`rigid_mm`) and the
        nearest trained object's motion. `ratio` is that to the error of the trained shape, whose scores are `seen`;
        `relative_ratio` is the same for errors as fractions of the displacement."""
        relative = self.pooled["model_mm"] / self.pooled["moved_mm"]
        return {
            "kind": self.shape.kind,
            "like": self.shape.like,
            "pushes": len(self.errors),
            "failed": list(self.shape.failed),
            "distance": self.distance,
            **self.pooled,
            "relative": relative,
            "seen_mm": seen["rmse_pooled_mm"],
            "seen_relative": seen["relative"],
            "ratio": self.pooled["model_mm"] / seen["rmse_pooled_mm"],
            "relative_ratio": relative / seen["relative"],
            "within_known_band": self.within,
        }


def measure(predictor: UserBodyPredictor, nearest: Predictor, shape: UnseenShape) -> Measured:
    """All pushes of a shape. `nearest` has the trained object that is carried over."""
    found = [predictions(predictor, nearest, motion) for motion in shape.motions]
    rest, weights = predictor.rest.points.astype(float), shape.item.weights

    def pooled(errors: list[Frames]) -> float:
        return float(np.sqrt(np.mean([_rmse(error) ** 2 for error in errors])))

    parts = [_parts(one, rest, weights) for one in found]
    local = [(one.model - one.rigid, one.truth - one.rigid) for one in found]
    fitting = sum(float((mine * true).sum()) for mine, true in local)
    errors = np.stack([_rmse(one.model - one.truth) for one in found])
    return Measured(
        shape,
        predictor.distance,
        errors,
        np.stack([_rmse(one.model) for one in found]),
        _within(predictor, shape, errors),
        {
            "moved_mm": pooled([one.truth for one in found]),
            "model_mm": pooled([one.model - one.truth for one in found]),
            "rigid_mm": pooled([one.rigid - one.truth for one in found]),
            "nearest_mm": pooled([one.nearest - one.truth for one in found]),
            "error_of_shift_mm": pooled([shift for shift, _, _ in parts]),
            "error_of_rotation_mm": pooled([rotated for _, rotated, _ in parts]),
            "error_of_deformation_mm": pooled([bend for _, _, bend in parts]),
            "best_share_of_deformation": fitting / sum(float((mine**2).sum()) for mine, _ in local),
        },
    )


def _within(predictor: UserBodyPredictor, shape: UnseenShape, errors: Floats) -> float | None:
    inside: list[np.ndarray] = []
    for motion, error in zip(shape.motions, errors, strict=True):
        given = {**motion.parameters, **predictor.parameters_like()}
        band = predictor.error_band(given, motion.times[1:])
        if band is None:
            return None
        inside.append(error <= band[:, 1])
    return float(np.mean(inside))


def _rmse(error: Frames) -> Floats:
    """(T - 1,) mm, over all coordinates, without frame 0."""
    return 1e3 * np.sqrt((error[1:] ** 2).mean(axis=(1, 2)))


def _parts(one: Predictions, rest: Points, weights: Perpoint) -> tuple[Frames, Frames, Frames]:
    """(T, N, 3) m: what the shift, the rotation and the deformation of the model are off, in axes of the scene."""
    moved = [_split(rest, frames, weights) for frames in (one.model, one.truth)]
    shift, rotated, bend = (mine - true for mine, true in zip(*moved, strict=True))
    return np.broadcast_to(shift, rotated.shape), rotated, bend


def _split(rest: Points, displaced: Frames, weights: Perpoint) -> tuple[Floats, Frames, Frames]:
    rotation, shift = best_rigid(rest, rest + displaced, weights)
    centred = rest - weights @ rest
    rotated = centred @ rotation.swapaxes(1, 2) - centred
    return shift[:, None], rotated, displaced - shift[:, None] - rotated
