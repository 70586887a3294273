from dataclasses import replace

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.dataset.training_data import TrainingData, prepare
from odeform.models.baselines.gp import GaussianProcess
from odeform.models.registry import open_checkpoint


@pytest.fixture(scope="module")
def data(dataset: Dataset) -> TrainingData:
    return prepare(dataset, modes=8)


def test_chosen_setting_is_the_best_of_all_starts(data: TrainingData) -> None:
    _, settings = GaussianProcess.fit(data)
    assert settings["trials"][0] != settings["trials"][1]
    best = min(settings["trials"], key=lambda trial: trial["error"])
    assert (settings["length_scales"], settings["ridge"]) == (best["length_scales"], best["ridge"])
    assert len(settings["length_scales"]) == data.theta["train"].shape[1]


def test_a_parameter_without_effect_gets_a_long_length_scale(data: TrainingData) -> None:
    """Motions that depend on the first parameter alone: the others hardly count."""
    rng = np.random.default_rng(0)
    theta = {split: rng.uniform(-1.0, 1.0, (count, 2)) for split, count in (("train", 40), ("val", 20))}
    shape = data.reduced["train"].shape[1:]
    wave = np.linspace(0.0, 1.0, np.prod(shape)).reshape(shape)
    reduced = {split: np.sin(2.0 * t[:, :1, None]) * wave for split, t in theta.items()}
    _, settings = GaussianProcess.fit(replace(data, theta=theta, reduced=reduced))
    first, second = settings["length_scales"]
    assert second > 5.0 * first


def test_files_with_weights_still_load() -> None:
    """Older ones hold what is solved for now from the coefficients."""
    checkpoint = open_checkpoint("kick/gp")
    new = GaussianProcess(checkpoint)
    kept = {name: array for name, array in checkpoint.arrays.items() if not name.startswith("pod.coefficients")}
    old = GaussianProcess(replace(checkpoint, arrays={**kept, "gp.weights": new._regression.weights}))
    times = np.linspace(0.0, 1.0, 5)
    assert np.array_equal(old.solve().vertices(times), new.solve().vertices(times))
