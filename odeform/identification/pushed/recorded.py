"""Reads recorded motions as experiments with a body: pushes, drops and throws."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.identification.pushed.evidence import Known
from odeform.identification.pushed.experiment import Experiment
from odeform.identification.pushed.forward import pushed_model
from odeform.identification.pushed.together import Made
from odeform.identification.pushed.views import points_of, window_of
from odeform.loads.registry import PUSH, get_load
from odeform.models.base import Predictor
from odeform.models.modal.training.impact_fit import FRAMES, first_contact
from odeform.types import Faces, Frames, MotionSequence

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
    one = recorded_experiment(predictor, PUSH, recorded, named)
    return points_of(one.made.times, one.surface, one.faces)


def recorded_experiment(
    predictor: Predictor, load: str, recorded: MotionSequence, setting: Mapping[str, Any]
) -> Recorded:
    """Reads a motion under a load, with parameters `setting` that select the body and say what happened to it.

    Of a push the frames of its window are taken, of a drop or a throw those of 120 ms from the first contact on.
    `InputError` for a motion of another surface, and for a fall of which a parameter is not known, or that ends before.
    """
    model = pushed_model(predictor, setting)
    if model is None or not np.array_equal(recorded.faces, model.rest.faces):
        raise InputError("identify: expected a motion of the body that the model knows, vertex by vertex")
    if load == PUSH:
        times, surface = window_of(recorded, model.schema.window.stop, model.schema.window.rate)
    else:
        falling = get_load(load)
        if unknown := [p.name for p in falling.parameters if p.name not in setting]:
            raise InputError(f"identify: expected a {load} that is known; {', '.join(unknown)} are not")
        known = recorded.frames(float(recorded.times[-1]), falling.window.rate)
        first = first_contact(known.vertices, falling, setting)
        if not 0 < first < len(known.times) - FRAMES:
            raise InputError(f"identify: expected a {load} that is recorded for 120 ms from its first contact on")
        seen = slice(first, first + FRAMES + 1)
        times, surface = known.times[seen].astype(float), known.vertices[seen].astype(float)
    return Recorded(Made(Experiment(load, dict(setting)), times), surface, recorded.faces)


def together_points(experiments: Sequence[Recorded]) -> Known:
    """Points of the surface in all experiments, those of one after those of the one before."""
    times = np.concatenate([one.made.times for one in experiments])
    return points_of(times, np.concatenate([one.surface for one in experiments]), experiments[0].faces)
