from dataclasses import replace

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.dataset.training_data import TrainingData, prepare
from odeform.models.base import Predictor
from odeform.models.baselines.nearest import Nearest
from odeform.models.baselines.pod_rbf import PodRbf


@pytest.fixture(scope="module")
def data(dataset: Dataset) -> TrainingData:
    return prepare(dataset, modes=8)


def test_nearest_gives_back_the_nearest_sequence(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    """Slightly different parameters than those of a training sequence: its very trajectory."""
    for entry in dataset.select("train")[:3]:
        near = {**entry.parameters, "mass": entry.parameters["mass"] * 1.001}
        one, two = (predictors["nearest"].solve(None, p).vertices(0.5) for p in (entry.parameters, near))
        assert np.array_equal(one, two)


def test_nearest_keeps_the_training_data(data: TrainingData) -> None:
    arrays, _ = Nearest.fit(data)
    assert np.array_equal(arrays["theta"], data.theta["train"])
    kept = np.concatenate([arrays["pose"], arrays["local"]], axis=2)
    assert np.allclose(kept, data.reduced["train"], rtol=0.0, atol=5e-6)


def test_pod_explains_the_training_data(data: TrainingData) -> None:
    arrays, settings = PodRbf.fit(data)
    flat = arrays["pod.mean"] + arrays["pod.coefficients"] @ arrays["pod.modes"]
    error = flat.reshape(data.reduced["train"].shape) - data.reduced["train"]
    spread = data.reduced["train"] - data.reduced["train"].mean(axis=0)
    assert np.sqrt((error**2).mean()) < 2e-2 * np.sqrt((spread**2).mean())
    assert settings["modes"] < len(data.theta["train"])


def test_chosen_setting_is_the_best_on_val(data: TrainingData) -> None:
    _, settings = PodRbf.fit(data)
    best = min(settings["trials"], key=lambda trial: trial["val"])
    assert (settings["kernel"], settings["smoothing"]) == (best["kernel"], best["smoothing"])


def test_few_sequences(data: TrainingData) -> None:
    few = {k: {s: v[:6] for s, v in getattr(data, k).items()} for k in ("theta", "reduced", "observed")}
    arrays, _ = PodRbf.fit(replace(data, **few))
    assert np.isfinite(arrays["pod.coefficients"]).all()
