"""Scores of whole motions, by which an error band is calibrated, kept in a checkpoint."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.conformal import FEWEST, SCORES, motion_score
from odeform.types import Floats

__all__ = ["attach", "whole_motion_scores"]


def whole_motion_scores(predictor: Predictor, dataset: Dataset, split: str) -> Floats:
    """(S,) the largest logarithm of error to band, over the trained frames, of each motion of a split.

    Raises:
        InputError: A model without an error band, or of several bodies.
    """
    if predictor.schema.objects or predictor.error_band(predictor.complete({}), np.ones(1)) is None:
        raise InputError(f"{predictor.model}: expected a model of one body that has an error band")
    scores = []
    for recorded in dataset.sequences(split):
        sequence = recorded.until(dataset.schema.window.stop)
        parameters = {**predictor.schema.known(dataset.fixed), **sequence.parameters}
        motion = predictor.solve(predictor.to_body_frame(sequence.rest, parameters), parameters)
        difference = motion.vertices(sequence.times).astype(float) - sequence.vertices
        errors = 1e3 * np.sqrt((difference**2).mean(axis=(1, 2)))
        band = predictor.error_band(parameters, sequence.times)
        assert band is not None
        scores.append(motion_score(errors, band[:, 1]))
    return np.array(scores)


def attach(predictor: Predictor, dataset: Dataset, split: str, path: str | Path) -> None:
    """Write the checkpoint of a model with the scores of motions that nothing was fitted to.

    Raises:
        InputError: Too few motions, or as `whole_motion_scores`.
    """
    checkpoint = predictor.checkpoint
    without = {name: array for name, array in checkpoint.arrays.items() if name != SCORES}
    plain = predictor.of_same_kind(replace(checkpoint, arrays=without))
    scores = whole_motion_scores(plain, dataset, split)
    if len(scores) < FEWEST:
        raise InputError(f"split {split}: expected at least {FEWEST} motions to calibrate on, got {len(scores)}")
    scored = {**without, SCORES: scores.astype(np.float32)}
    plain.of_same_kind(replace(checkpoint, arrays=scored)).save(path)
