"""Reads recorded motions as experiments with a body: pushes, drops and throws."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.identification.pushed.evidence import Known
from odeform.identification.pushed.experiment import Experiment
from odeform.identification.pushed.forward import pushed_model
from odeform.identification.pushed.state import PUSH_NAMES
from odeform.identification.pushed.together import Made
from odeform.identification.pushed.views import points_of, window_of
from odeform.loads.registry import PUSH, get_load
from odeform.models.base import Predictor
from odeform.models.modal.training.impact_fit import FRAMES, first_contact
from odeform.types import Faces, Frames, MotionSequence, Times

__all__ = ["Recorded", "recorded_experiment", "recorded_points", "together_points"]


@dataclass(frozen=True, eq=False)
class Recorded:
    """An experiment of which the motion was recorded."""

    made: Made
    surface: Frames
    """(T, S, 3) m at the times of `made`."""
    faces: Faces


def recorded_points(predictor: Predictor, recorded: MotionSequence, named: Mapping[str, Any]) -> Known:
    """Observes a recorded push of the body that `named` selects. `InputError` where it is one of another surface."""
    return points_of(*_seen(predictor, PUSH, recorded, named), recorded.faces)


def recorded_experiment(
    predictor: Predictor, load: str, recorded: MotionSequence, setting: Mapping[str, Any]
) -> Recorded:
    """Reads a motion under a load, with parameters `setting` that select the body and say what happened to it.

    Of a push the frames of its window are taken, of a drop or a throw those of 120 ms from the first contact on.
    `InputError` for a motion of another surface, one of which a parameter is not known, and a fall that ends before.
    """
    names = PUSH_NAMES if load == PUSH else tuple(p.name for p in get_load(load).parameters)
    if unknown := [name for name in names if name not in setting]:
        raise InputError(f"identify: expected a {load} that is known; {', '.join(unknown)} are not")
    times, surface = _seen(predictor, load, recorded, setting)
    return Recorded(Made(Experiment(load, dict(setting)), times), surface, recorded.faces)


def _seen(
    predictor: Predictor, load: str, recorded: MotionSequence, setting: Mapping[str, Any]
) -> tuple[Times, Frames]:
    """(T,) s and the surface (T, S, 3) m then."""
    model = pushed_model(predictor, setting)
    if model is None or not np.array_equal(recorded.faces, model.rest.faces):
        raise InputError("identify: expected a motion of the body that the model knows, vertex by vertex")
    if load == PUSH:
        return window_of(recorded, model.schema.window.stop, model.schema.window.rate)
    falling = get_load(load)
    known = recorded.frames(float(recorded.times[-1]), falling.window.rate)
    first = first_contact(known.vertices, falling, setting)
    if not 0 < first < len(known.times) - FRAMES:
        raise InputError(f"identify: expected a {load} that is recorded for 120 ms from its first contact on")
    seen = slice(first, first + FRAMES + 1)
    return known.times[seen].astype(float), known.vertices[seen].astype(float)


def together_points(experiments: Sequence[Recorded]) -> Known:
    """Points of the surface in all experiments, those of one after those of the one before."""
    times = np.concatenate([one.made.times for one in experiments])
    return points_of(times, np.concatenate([one.surface for one in experiments]), experiments[0].faces)
