from collections.abc import Iterator

import numpy as np
import pytest
import torch
from scipy.interpolate import CubicSpline

from odeform.dataset.index import Dataset
from odeform.dataset.training_data import TrainingData, prepare
from odeform.models.latent.training.config import TrainConfig
from odeform.models.latent.training.random_features import widen
from odeform.models.latent.training.start import build_network
from odeform.models.latent.training.trainer import Trainer


@pytest.fixture(autouse=True)
def fast() -> Iterator[None]:
    """As training does: denormal numbers are slow."""
    torch.set_flush_denormal(True)
    yield
    torch.set_flush_denormal(False)


@pytest.fixture(scope="module")
def data(dataset: Dataset) -> TrainingData:
    return prepare(dataset, modes=8)


def widened(data: TrainingData, **settings: object) -> Trainer:
    trainer = Trainer(build_network(data, 0), data, TrainConfig(random_features=300, **settings), torch.device("cpu"))  # type: ignore[arg-type]
    widen(trainer, 300)
    return trainer


def off_the_spline(trainer: Trainer) -> float:
    """RMS distance halfway between frames, in mm, from the cubic spline through the truth of the training sequences."""
    net, frames = trainer.net, np.arange(trainer.frames + 1)
    with torch.no_grad():
        times = trainer.frame / 2.0 * torch.arange(2 * trainer.frames + 1, dtype=torch.float64)
        predicted = net.decode(trainer.paths("train"), times, trainer.theta["train"])[1::2]
    between = torch.as_tensor(CubicSpline(frames, trainer.truth["train"].numpy())(frames[:-1] + 0.5))
    return float(((predicted - between) * trainer.metric.scale)[..., 6:].square().sum(dim=-1).mean().sqrt())


def test_sharp_features_keep_to_the_spline_between_frames(data: TrainingData) -> None:
    """Without that they miss it several times as much, for a fit of the frames that is hardly better."""
    settings = {"sharpnesses": (4.0,), "ridges": (1e-10,)}
    free, held = (widened(data, between=weight, **settings) for weight in (0.0, 0.1))
    assert off_the_spline(held) < 0.5 * off_the_spline(free)
    assert held.errors_mm("train")[1] < 2.0 * free.errors_mm("train")[1]


def test_validation_chooses(data: TrainingData) -> None:
    """Of several settings the result is the best, for each decoder by itself; sharpness is chosen by some moments."""

    def errors(**settings: object) -> tuple[float, float]:
        return widened(data, between=0.0, deformed=1.0, **settings).errors_mm("val")

    each = [errors(sharpnesses=(s,), ridges=(r,)) for s in (0.5, 2.0) for r in (1e-4, 1e-8)]
    assert len(set(each)) == 4
    chosen = errors(sharpnesses=(0.5, 2.0), ridges=(1e-4, 1e-8))
    for error, part in zip(chosen, zip(*each, strict=True), strict=True):
        assert min(part) <= error < 1.05 * min(part)
        assert error < np.mean(part)
