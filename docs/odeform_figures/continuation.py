"""Continuations of bundled models, fitted again."""

from dataclasses import replace

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.training_data import prepare
from odeform.errors import InputError
from odeform.models.registry import load_model
from odeform.models.training.continuation import is_continued, with_continuation

__all__ = ["refitted"]


def refitted(checkpoint: Checkpoint, dataset: Dataset) -> Checkpoint:
    """The checkpoint of a model that was trained on all frames of `dataset`, with a continuation of today's version.

    Within the trained window, its motions stay bit-identical. `InputError` for a model that is never continued.
    """
    model = load_model(checkpoint)
    if not is_continued(model):
        raise InputError(f"{checkpoint.model}: expected a model of reduced coordinates of one body, which is continued")
    data, space = prepare(dataset, model.space.basis), model.space
    reduced = {split: np.stack([space.with_patterns(y) for y in motions]) for split, motions in data.reduced.items()}
    return with_continuation(model, replace(data, space=space, reduced=reduced))
