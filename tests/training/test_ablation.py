"""Trainings without one part: what is left out has no effect."""

from pathlib import Path

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.models.latent.model import LatentModel
from odeform.models.training.request import TrainRequest
from odeform.training.train import train


def trained(dataset: Dataset, out: Path, *without: str) -> LatentModel:
    found = train(dataset, out, steps=2, without=without, report=lambda line: None)
    assert isinstance(found, LatentModel)
    assert found.checkpoint.provenance["command"][-1].endswith(f"--without {','.join(without)}")
    return found


@pytest.mark.slow
def test_without_an_ode_the_state_stays(dataset: Dataset, tmp_path: Path) -> None:
    model = trained(dataset, tmp_path / "a.safetensors", "ode", "residual")
    theta = np.zeros(model.config.parameters)
    field, start, *_ = model.problem(theta, model.evaluate_basis(model.rest, 0.0), np.float64)
    assert not field(0.1, start + 1.0).any()
    assert model.residual is None


@pytest.mark.slow
def test_without_conditions_decoders_know_states_alone(dataset: Dataset, tmp_path: Path) -> None:
    model = trained(dataset, tmp_path / "a.safetensors", "clock", "parameters", "residual")
    states, body = np.ones((5, model.config.state)), model.evaluate_basis(model.rest, 0.0)
    times, thetas = np.linspace(0.1, 0.9, 5), [np.full(model.config.parameters, value) for value in (-0.3, 0.6)]
    readouts = [model.problem(theta, body, np.float64).readout for theta in thetas]
    # coordinates are relative to the start, which the parameters do change
    found = [readout(times, states) - readout(times, 0.0 * states) for readout in readouts]
    np.testing.assert_allclose(found, np.broadcast_to(found[0][0], np.shape(found)), atol=1e-12)


@pytest.mark.slow
def test_without_random_features(dataset: Dataset, tmp_path: Path) -> None:
    assert trained(dataset, tmp_path / "a.safetensors", "random-features").config.random_features == 0


def test_bad_requests() -> None:
    with pytest.raises(InputError, match="without 'wings': latent has ode, clock, parameters"):
        TrainRequest(without=("wings",))
    with pytest.raises(InputError, match="without 'ode': gp has no such parts"):
        TrainRequest("gp", without=("ode",))
    with pytest.raises(InputError, match="without 'clock': rolling has network, corners, residual"):
        TrainRequest("rolling", without=("clock",))
    with pytest.raises(InputError, match="sequences: expected a positive number"):
        TrainRequest(sequences=0)


def test_more_sequences_than_there_are(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="sequences: expected at most"):
        train(dataset, tmp_path / "a.safetensors", "nearest", sequences=10**6, report=lambda line: None)


def test_fewer_sequences(dataset: Dataset, tmp_path: Path) -> None:
    model = train(dataset, tmp_path / "a.safetensors", "pod-rbf", sequences=4, report=lambda line: None)
    assert "--sequences 4" in model.checkpoint.provenance["command"][-1]
    assert len(model.checkpoint.arrays["theta"]) == 4
