"""The errors of a model on the validation split, from which its error band is estimated."""

import numpy as np

from odeform.dataset.index import Dataset
from odeform.models.base import Predictor
from odeform.models.registry import observations
from odeform.types import Arrays

__all__ = ["validation_residuals"]


def validation_residuals(predictor: Predictor, dataset: Dataset, split: str = "val") -> Arrays:
    """Arrays of a checkpoint: `val.theta` (S, P) parameters in [-1, 1], `val.times` (T,) s, and `val.rmse_mm` (S, T),
    the RMSE over all coordinates of each frame of each sequence."""
    window = predictor.schema.window
    # the error at given frames says nothing about the frames between them
    rate = dataset.schema.window.rate if predictor.schema.needs_observations else window.rate
    times = np.linspace(window.start, window.stop, round((window.stop - window.start) * rate) + 1)
    theta, errors = [], []
    for recorded in dataset.sequences(split):
        truth = recorded.until(window.stop)
        at = np.searchsorted(truth.times, times - 1e-6)
        given = observations(predictor.schema, truth)
        predicted = predictor.solve(truth.rest, truth.parameters, observed=given).vertices(times)
        off = predicted.astype(float) - truth.vertices[at]
        theta.append(predictor.schema.vector(truth.parameters))
        errors.append(1e3 * np.sqrt((off**2).mean(axis=(1, 2))))
    return {
        "val.theta": np.array(theta, dtype=np.float32),
        "val.times": times.astype(np.float32),
        "val.rmse_mm": np.array(errors, dtype=np.float32),
    }
