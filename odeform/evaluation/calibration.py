"""Scores of whole motions, by which an error band is calibrated, kept in a checkpoint."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.conformal import FEWEST, SCORES, motion_score
from odeform.models.error_band import SIZES
from odeform.models.registry import observations
from odeform.schema import OBJECT
from odeform.types import Arrays, Floats, MotionSequence

__all__ = ["attach", "whole_motion_scores"]


def whole_motion_scores(predictor: Predictor, dataset: Dataset, split: str) -> Floats:
    """(S,) the largest logarithm of error to band, over the trained frames, of each motion of a split.

    Raises:
        InputError: A model without an error band.
    """
    return np.array([_score(predictor, dataset, recorded) for recorded in dataset.sequences(split)])


def _score(predictor: Predictor, dataset: Dataset, recorded: MotionSequence) -> float:
    window = predictor.schema.window
    whole = recorded.until(window.stop)
    frames = (whole.times - window.start) * window.rate
    on_frames = np.abs(frames - frames.round()) < 1e-3
    if predictor.final_only:
        on_frames &= whole.times > window.stop - 0.5 / window.rate
    truth = replace(whole, times=whole.times[on_frames], vertices=whole.vertices[on_frames])
    parameters = {**predictor.schema.known(dataset.fixed), **truth.parameters}
    rest = predictor.to_body_frame(whole.rest, parameters)
    motion = predictor.solve(rest, parameters, observed=observations(predictor.schema, whole))
    band = predictor.error_band(parameters, truth.times, lambda: motion.size_mm)
    if band is None:
        raise InputError(f"{predictor.model}: expected a model that has an error band")
    difference = motion.vertices(truth.times).astype(float) - truth.vertices
    return motion_score(1e3 * np.sqrt((difference**2).mean(axis=(1, 2))), band[:, 1])


def attach(predictor: Predictor, dataset: Dataset, split: str, path: str | Path, source: str = "") -> None:
    """Write the checkpoint of a model with the scores of motions that nothing was fitted to, of each object its own.

    `source` says in words which motions these are; the checkpoint keeps it as `provenance["band"]`.

    Raises:
        InputError: Too few motions, or as `whole_motion_scores`.
    """
    checkpoint = predictor.checkpoint
    without = {name: array for name, array in checkpoint.arrays.items() if name.rpartition("/")[2] != SCORES}
    without |= _sizes(predictor)
    plain = predictor.of_same_kind(replace(checkpoint, arrays=without))
    if predictor.schema.objects:
        known = [name for name in predictor.schema.objects if name in dataset.objects]
        each = {f"{name}/": dataset.of(name) for name in known}
    else:
        each = {"": dataset}
    scored = {f"{prefix}{SCORES}": _enough(plain, part, split) for prefix, part in each.items()}
    provenance = {**checkpoint.provenance, "band": source}
    plain.of_same_kind(replace(checkpoint, arrays={**without, **scored}, provenance=provenance)).save(path)


def _sizes(predictor: Predictor) -> Arrays:
    """How far the validation sequences of each object are predicted to move, which older checkpoints do not say."""
    schema = predictor.schema
    if schema.needs_observations:
        return {}
    out = {}
    for name in schema.objects or ("",):
        prefix, body = (f"{name}/", {OBJECT: name}) if name else ("", {})
        theta = predictor.checkpoint.arrays.get(f"{prefix}val.theta", np.zeros((0, 0)))
        sets = [
            {p.name: p.denormalise(float(unit)) for p, unit in zip(schema.learned, row, strict=True)} for row in theta
        ]
        sizes = [predictor.size_mm({**body, **one}) for one in sets]
        out |= {f"{prefix}{SIZES}": np.array(sizes, dtype=np.float32)} if sizes else {}
    return out


def _enough(predictor: Predictor, dataset: Dataset, split: str) -> Floats:
    scores = whole_motion_scores(predictor, dataset, split)
    if len(scores) < FEWEST:
        raise InputError(f"split {split}: expected at least {FEWEST} motions to calibrate on, got {len(scores)}")
    return scores.astype(np.float32)
