"""Shared fixtures: a small real data set, simulated once, and a model trained on it for seconds."""

import functools
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import jaxtyping
import pytest
from joblib import parallel_config

import odeform.training.loop  # noqa: F401  (declares types of the real settings, before they are patched)
from odeform.dataset.index import Dataset
from odeform.models.baselines.point_network import Trial
from odeform.predictor import Predictor, load
from odeform.simulation.runner import simulate_dataset
from odeform.simulation.scene import get_scene
from odeform.simulation.scenes import kick as kick_scene
from odeform.training import config
from odeform.training.train import POINTS, TrainRequest, train


def _coarsen(patch: pytest.MonkeyPatch) -> None:
    """A kick of a quarter of the vertices, simulated in this process (others would not know of it)."""
    scene = kick_scene.SCENE
    simulate = functools.partial(kick_scene.simulate, segments=4)
    patch.setattr(kick_scene, "SCENE", replace(scene, simulate=simulate, step=2e-3))


@contextmanager
def _unchecked() -> Iterator[None]:
    """Shapes and types are not checked at run time, which takes longer than the ODE does where one is solved over and
    over. Shorter tests of the same functions check them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jaxtyping.config, "jaxtyping_disable", True)
        yield


@pytest.fixture
def unchecked() -> Iterator[None]:
    with _unchecked():
        yield


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kicks are simulated as those of `dataset` were, in 0.7 s rather than 15."""
    _coarsen(monkeypatch)


@pytest.fixture(scope="session")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """Coarse kicks: really simulated, with fewer vertices and at a larger step than the scene's own."""
    with pytest.MonkeyPatch.context() as patch, parallel_config(backend="threading"):
        _coarsen(patch)
        return simulate_dataset("kick", tmp_path_factory.mktemp("kick"), count=21, seed=3, workers=2)


@pytest.fixture(scope="session")
def trained(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A checkpoint of every model, each trained on the small data set; with fewer random features, for time."""
    root, rest, paths = tmp_path_factory.mktemp("models"), get_scene("kick").rest_mesh(), {}
    few = functools.partial(config.TrainConfig, random_features=200, sharpnesses=(1.0,))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(config, "TrainConfig", few)
        for model in ("odeform", "pod-rbf", "nearest"):
            paths[model] = root / f"{model}.safetensors"
            train(dataset, rest, paths[model], TrainRequest(model, seed=1, steps=60), lambda _: None)
    return paths


@pytest.fixture(scope="session")
def predictors(trained: dict[str, Path]) -> dict[str, Predictor]:
    return {model: load(path) for model, path in trained.items()}


@pytest.fixture(scope="session")
def point_models(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A checkpoint of every model that moves each point by itself: narrow, and trained for a few steps."""
    root, rest, paths = tmp_path_factory.mktemp("points"), get_scene("kick").rest_mesh(), {}
    with pytest.MonkeyPatch.context() as patch, _unchecked():
        for name, model in POINTS.items():
            patch.setattr(model.network, "trials", (Trial(1e-2, 24), Trial(3e-3, 24)), raising=False)
            patch.setattr(model.network, "work", 256, raising=False)
            paths[name] = root / f"{name}.safetensors"
            steps = 210 if model.network.teaching == "moments" else 56  # which are cheap
            train(dataset, rest, paths[name], TrainRequest(name, seed=1, steps=steps, every=4), lambda _: None)
    return paths


@pytest.fixture(scope="session")
def kick() -> Predictor:
    """The bundled model."""
    return load("kick")
