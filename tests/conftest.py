"""Shared fixtures: a small simulated data set and models trained on it for seconds, made once for all workers."""

import functools
import math
import os
import subprocess
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import jaxtyping
import pytest
import torch
from filelock import FileLock
from joblib import parallel_config
from threadpoolctl import threadpool_limits

import odeform.models.latent.training.loop  # noqa: F401  (declares types of the real settings, before they are patched)
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.models.base import Predictor
from odeform.models.latent.training import config
from odeform.models.points.point_network import Trial
from odeform.models.registry import load
from odeform.simulation import runner
from odeform.simulation.scenes import kick as kick_scene
from odeform.training.train import train

RANGES = {"mass": (0.5, 1.0), "bending": (0.3, 2.0), "force": (100.0, 150.0), "elevation": (0.5, math.pi / 4)}
"""Of the small data set: a part of the scene's, in which few sequences tell something of others."""


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> Iterator[None]:
    """Workers share the cores: products on several threads would wait for each other."""
    torch.set_num_threads(1)
    with pytest.MonkeyPatch.context() as patch, threadpool_limits(1, "blas"):
        patch.setenv("OMP_NUM_THREADS", "1")  # for processes that tests start
        yield


@pytest.fixture(autouse=True)
def no_process_is_left(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Processes that a test starts end with it; one that is left is killed, and the test fails."""
    started: list[subprocess.Popen[Any]] = []
    start = subprocess.Popen.__init__

    def remember(process: subprocess.Popen[Any], *args: Any, **settings: Any) -> None:
        start(process, *args, **settings)
        started.append(process)

    monkeypatch.setattr(subprocess.Popen, "__init__", remember)
    yield
    left = [process for process in started if process.poll() is None]
    for process in left:
        process.kill()
        process.wait()
    assert not left, f"left running: {[process.args for process in left]}"


def _coarsen(patch: pytest.MonkeyPatch) -> None:
    """A kick of a quarter of the vertices, simulated in this process (others would not know of it)."""
    scene = kick_scene.SCENE
    simulate = functools.partial(kick_scene.simulate, resolution=4)
    patch.setattr(kick_scene, "SCENE", replace(scene, simulate=simulate, step=2e-3, resolutions=(4,)))


FIRST, EVERY = 2_000, 101
"""So many calls of a test have their shapes and types checked, and then one in so many. A check takes longer than a
step of an ODE: with all of them, the tests of mechanics took twice as long."""


class _Sparing(type(jaxtyping.config)):
    """A configuration that is asked at each call whether it goes unchecked."""

    calls, never = 0, False

    @property
    def jaxtyping_disable(self) -> bool:
        self.calls += 1
        return self.never or (self.calls > FIRST and self.calls % EVERY > 0)


jaxtyping.config.__class__ = _Sparing


DEFINED = 10
"""So many times a function inside of another has its checks made in a test: it is defined anew in each call of the
outer one, and making its checks takes 4 ms."""
_defined: Counter[CodeType] = Counter()
_jaxtyped = jaxtyping.jaxtyped


def _sparingly_jaxtyped(**settings: Any) -> Callable[[Any], Any]:
    checked = _jaxtyped(**settings)

    def decorate(defined: Any) -> Any:
        if isinstance(defined, FunctionType) and "<locals>" in defined.__qualname__:
            _defined[defined.__code__] += 1
            if _defined[defined.__code__] > DEFINED:
                return defined
        return checked(defined)

    return decorate


jaxtyping.jaxtyped = _sparingly_jaxtyped


@pytest.fixture(autouse=True)
def checked_sparingly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test begins to count its calls and definitions."""
    monkeypatch.setattr(jaxtyping.config, "calls", 0)
    _defined.clear()


@pytest.fixture
def unchecked(monkeypatch: pytest.MonkeyPatch) -> None:
    """As outside of tests: annotations refuse nothing."""
    monkeypatch.setattr(jaxtyping.config, "never", True)


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kicks are simulated as those of `dataset` were, in 0.7 s rather than 15."""
    _coarsen(monkeypatch)


@pytest.fixture(scope="session")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Callable[[Path], object]], Path]:
    """A folder of that name, filled by the first worker that asks for it; the others wait for it."""
    root = tmp_path_factory.getbasetemp()
    root = root.parent if "PYTEST_XDIST_WORKER" in os.environ else root

    def make(name: str, fill: Callable[[Path], object]) -> Path:
        folder, done = root / name, root / f"{name}.done"
        with FileLock(f"{folder}.lock"):
            if not done.exists():
                fill(folder)
                done.touch()
        return folder

    return make


MadeOnce = Callable[[str, Callable[[Path], object]], Path]


@pytest.fixture(scope="session")
def dataset(made_once: MadeOnce) -> Dataset:
    """Coarse kicks: really simulated, with fewer vertices and a larger step than the scene's own."""

    def simulate(folder: Path) -> None:
        with pytest.MonkeyPatch.context() as patch, parallel_config(backend="threading"):
            _coarsen(patch)
            runner.simulate("kick", folder, count=21, seed=3, workers=2, ranges=RANGES)

    return open_dataset(made_once("kick", simulate))


@pytest.fixture(scope="session")
def trained(dataset: Dataset, made_once: MadeOnce) -> dict[str, Path]:
    """A checkpoint of every reduced model, trained on the small data set with few random features."""
    models = ("odeform", "pod-rbf", "nearest")

    def fit(folder: Path) -> None:
        few = functools.partial(config.TrainConfig, random_features=200, sharpnesses=(1.0,))
        folder.mkdir()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(config, "TrainConfig", few)
            for model in models:
                path = folder / f"{model}.safetensors"
                # on so few motions the regression alone would be as good, and the ODE have no share
                without = ("residual",) if model == "odeform" else ()
                train(dataset, path, model, seed=1, steps=60, without=without, report=_silent)

    folder = made_once("models", fit)
    return {model: folder / f"{model}.safetensors" for model in models}


@pytest.fixture(scope="session")
def predictors(trained: dict[str, Path]) -> dict[str, Predictor]:
    return {model: load(path) for model, path in trained.items()}


@pytest.fixture(scope="session")
def point_models(dataset: Dataset, made_once: MadeOnce) -> dict[str, Path]:
    """A checkpoint of every model that moves each point by itself: narrow, and trained for a few steps."""

    from point_models import POINT_MODELS  # few tests need these modules

    def fit(folder: Path) -> None:
        folder.mkdir()
        with pytest.MonkeyPatch.context() as patch:
            for name, model in POINT_MODELS.items():
                patch.setattr(model.network, "trials", (Trial(1e-2, 24), Trial(3e-3, 24)), raising=False)
                patch.setattr(model.network, "work", 256, raising=False)
                steps = 210 if model.network.sampling == "moments" else 56  # a step of these is cheap
                path = folder / f"{name}.safetensors"
                train(dataset, path, name, seed=1, steps=steps, every=4, report=_silent)

    folder = made_once("points", fit)
    return {name: folder / f"{name}.safetensors" for name in POINT_MODELS}


def _silent(_: str) -> None:
    """Training reports its progress to nobody."""


@pytest.fixture(scope="session")
def kick() -> Predictor:
    """The bundled model."""
    return load("kick")
