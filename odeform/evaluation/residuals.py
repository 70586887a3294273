"""Measures a model on data it was made from: errors, for its error band, and depths, for the plausibility check."""

import itertools

import numpy as np

from odeform.dataset.index import Dataset
from odeform.models.base import Predictor
from odeform.models.error_band import SIZES
from odeform.models.reduced_model import ReducedModel
from odeform.models.registry import observations
from odeform.types import Arrays

__all__ = ["trained_depth", "validation_residuals"]

SEQUENCES, FEW = 64, 8  # training sequences whose depth is looked up; few for models that move each point by itself


def validation_residuals(predictor: Predictor, dataset: Dataset, split: str = "val") -> Arrays:
    """Returns the arrays of a checkpoint, of several objects each, as OBJECT/val.theta.

    These are `val.theta` (S, P) parameters in [-1, 1], `val.times` (T,) s, `val.rmse_mm` (S, T), the RMSE over all
    coordinates of each frame of each sequence, and `val.size_mm` (S,), how far each is predicted to move, unless that
    needs observed frames.
    """
    if len(dataset.objects) < 2:
        return _residuals(predictor, dataset, split)
    each = {name: _residuals(predictor, dataset.of(name), split) for name in dataset.objects}
    return {f"{name}/{key}": array for name, arrays in each.items() for key, array in arrays.items()}


def _residuals(predictor: Predictor, dataset: Dataset, split: str) -> Arrays:
    window = predictor.schema.window
    # the error at given frames says nothing about the frames between them
    rate = dataset.schema.window.rate if predictor.schema.needs_observations else window.rate
    times = np.linspace(window.start, window.stop, round((window.stop - window.start) * rate) + 1)
    times = times[[0, -1]] if predictor.final_only else times
    theta, errors, sizes = [], [], []
    for recorded in dataset.sequences(split):
        truth = recorded.until(window.stop)
        at = np.searchsorted(truth.times, times - 1e-6)
        given = observations(predictor.schema, truth)
        predicted = predictor.solve(truth.rest, truth.parameters, observed=given).vertices(times)
        difference = predicted.astype(float) - truth.vertices[at]
        theta.append(predictor.schema.vector(truth.parameters))
        errors.append(1e3 * np.sqrt((difference**2).mean(axis=(1, 2))))
        if not predictor.schema.needs_observations:
            sizes.append(predictor.size_mm({**predictor.schema.known(dataset.fixed), **truth.parameters}))
    return {
        "val.theta": np.array(theta, dtype=np.float32),
        "val.times": times.astype(np.float32),
        "val.rmse_mm": np.array(errors, dtype=np.float32),
        **({SIZES: np.array(sizes, dtype=np.float32)} if sizes else {}),
    }


def trained_depth(predictor: Predictor, dataset: Dataset) -> Arrays:
    """Array of a checkpoint: `trained.depth_m` (1,), how far below z = 0 predicted motions of the training split take
    the trained body, in metres; of several objects each, as OBJECT/trained.depth_m.

    A coarse mesh that rests on its faces leaves the fine body that stands for it some millimetres in the floor.
    """
    if len(dataset.objects) < 2:
        return _depth(predictor, dataset)
    each = {name: _depth(predictor, dataset.of(name)) for name in dataset.objects}
    return {f"{name}/{key}": array for name, arrays in each.items() for key, array in arrays.items()}


def _depth(predictor: Predictor, dataset: Dataset) -> Arrays:
    depth, window = 0.0, predictor.schema.window
    count = SEQUENCES if isinstance(predictor, ReducedModel) else FEW
    for recorded in itertools.islice(dataset.sequences("train"), count):
        given = observations(predictor.schema, recorded.until(window.stop))
        plausibility = predictor.solve(None, recorded.parameters, observed=given).plausibility
        if plausibility is None:
            return {}
        depth = max(depth, -float(plausibility.sample(window.times).lowest.min()))
    return {"trained.depth_m": np.array([depth], dtype=np.float32)}
