"""What the latent ODE leaves unexplained: corrected where that is a smooth function of the parameters."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.dataset.training_data import TrainingData, prepare
from odeform.models.base import Predictor
from odeform.models.latent.model import LatentModel
from odeform.models.residual import ParameterRegression, Residual, parameter_residual
from odeform.models.training.pruning import FINE
from odeform.models.training.residual_fit import with_residual
from odeform.motion.reduced_space import POSE
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats

EXACT = SolverSettings("dopri5", tolerance=1e-9, dtype="float64")


@pytest.fixture(scope="module")
def bare(predictors: dict[str, Predictor]) -> LatentModel:
    model = cast(LatentModel, predictors["odeform"])
    arrays = {name: a for name, a in model.checkpoint.arrays.items() if not name.startswith("correction.")}
    return LatentModel(replace(model.checkpoint, arrays=arrays))


@pytest.fixture(scope="module")
def data(dataset: Dataset, bare: LatentModel) -> TrainingData:
    """The model's own motions plus 2 mm of heave and of the first mode that vary smoothly with the parameters."""
    data = prepare(dataset, bare.space.basis.modes)
    return replace(data, reduced={split: _own(bare, data, split) + _smooth(data, split) for split in data.reduced})


def _own(model: LatentModel, data: TrainingData, split: str) -> Floats:
    evaluated, stop = model.evaluate_basis(model.rest, 0.0), float(data.times[-1])
    return np.stack([model.trajectory(t, evaluated, FINE, stop).reduced(data.times) for t in data.theta[split]])


def _smooth(data: TrainingData, split: str) -> Floats:
    out = np.zeros_like(data.reduced[split])
    wave = 2e-3 * np.sin(data.theta[split].sum(axis=1))[:, None] * np.sin(7.0 * data.times)
    out[..., 2] = out[..., POSE] = wave
    return out


def regression_of(model: LatentModel) -> tuple[ParameterRegression, Residual]:
    assert model.residual is not None
    assert isinstance(model.residual.regression, ParameterRegression)
    return model.residual.regression, model.residual


@pytest.fixture(scope="module")
def corrected(bare: LatentModel, data: TrainingData) -> LatentModel:
    return LatentModel(with_residual(bare.checkpoint, data))


def test_a_smooth_residual_is_corrected(bare: LatentModel, corrected: LatentModel, data: TrainingData) -> None:
    assert set(regression_of(corrected)[0].parts) == {"shift", "deformation"}  # rotations had no residual

    def missed(model: LatentModel) -> float:
        return float(np.square(_own(model, data, "val") - data.reduced["val"]).mean())

    assert missed(corrected) < 0.25 * missed(bare)


def test_an_ode_that_misleads_gives_way_to_the_regression(bare: LatentModel, data: TrainingData) -> None:
    truth = {split: 10.0 * _smooth(data, split) for split in data.reduced}
    model = LatentModel(with_residual(bare.checkpoint, replace(data, reduced=truth)))
    assert regression_of(model)[0].parts["shift"].weight < 0.1
    assert model.checkpoint.config["correction"]["share_of_ode"]["shift"] < 0.1
    missed = _own(model, data, "val") - truth["val"]
    assert np.square(missed).sum() < 0.02 * np.square(truth["val"]).sum()


def test_a_share_that_may_be_chance_is_zero(bare: LatentModel, data: TrainingData) -> None:
    shares = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        truth = {split: 10.0 * _smooth(data, split) for split in data.reduced}
        truth = {split: y + 1e-3 * rng.standard_normal((len(y), 1, 1)) for split, y in truth.items()}
        config = with_residual(bare.checkpoint, replace(data, reduced=truth)).config
        shares += config["correction"]["share_of_ode"].values()
    assert sum(share > 0.0 for share in shares) <= 0.15 * len(shares)  # 0.05 are expected


def test_noise_is_not_corrected(bare: LatentModel, data: TrainingData) -> None:
    rng = np.random.default_rng(0)
    noisy = {split: _own(bare, data, split) for split in data.reduced}
    noisy = {split: y + 1e-3 * rng.standard_normal(y.shape) for split, y in noisy.items()}
    assert with_residual(bare.checkpoint, replace(data, reduced=noisy)) is bare.checkpoint


def test_filled_frames_are_no_truth(bare: LatentModel, data: TrainingData) -> None:
    observed = {split: frames.copy() for split, frames in data.observed.items()}
    observed["train"][:, 1::2] = False
    assert with_residual(bare.checkpoint, replace(data, observed=observed)) is bare.checkpoint


def test_it_rests_at_the_start_and_keeps_its_last_value(corrected: LatentModel) -> None:
    (_, residual), stop = regression_of(corrected), corrected.schema.window.stop
    values = residual.over_time(np.full(corrected.config.parameters, 0.4))(np.array([0.0, stop, 2.0 * stop]))
    np.testing.assert_allclose(values[0], 0.0, atol=1e-15)
    assert values[1].any()
    np.testing.assert_allclose(values[1], values[2], rtol=1e-12, atol=1e-18)  # rows of a product round differently


def test_fewer_modes_are_corrected_as_before(corrected: LatentModel) -> None:
    regression, residual = regression_of(corrected)
    theta, times = np.full(corrected.config.parameters, 0.4), np.linspace(0.0, 1.0, 5)
    fewer = regression.first(3).residual(residual.times).over_time(theta)(times)
    np.testing.assert_allclose(fewer, residual.over_time(theta)(times)[:, : POSE + 3], atol=1e-15)


def test_files_without_share_mean_and_order_are_read(corrected: LatentModel) -> None:
    regression, residual = regression_of(corrected)
    arrays = regression.arrays(residual.times)
    old = {name: a for name, a in arrays.items() if not name.endswith((".share", ".mean", ".order"))}
    read = parameter_residual(old, len(residual.weight), corrected.config.parameters)
    assert read is not None
    assert isinstance(read.regression, ParameterRegression)
    assert (read.weight == 1.0).all()
    assert not read.regression.parts["shift"].mean.any()
    assert read.regression.parts["shift"].regression.kernel.order == 2


def test_derivatives_are_those_of_the_motion(corrected: LatentModel) -> None:
    theta, times = np.linspace(-0.5, 0.6, corrected.config.parameters), np.linspace(0.05, 0.9, 7)
    jet = corrected.sensitivities(theta, times, EXACT)
    evaluated, step = corrected.evaluate_basis(corrected.rest, 0.0), 1e-4

    def motion(at: Floats) -> Floats:
        return corrected.trajectory(at, evaluated, EXACT, 1.0).reduced(times)

    np.testing.assert_allclose(jet[0], motion(theta), atol=1e-9)
    for index, ahead in enumerate(step * np.eye(len(theta))):
        central = (motion(theta + ahead) - motion(theta - ahead)) / (2.0 * step)
        np.testing.assert_allclose(jet[1 + index], central, atol=2e-5 * np.abs(jet[1 + index]).max())


def test_it_is_read_as_it_was_written(corrected: LatentModel) -> None:
    regression, residual = regression_of(corrected)
    arrays, size, parameters = regression.arrays(residual.times), len(residual.weight), corrected.config.parameters
    read = parameter_residual(arrays, size, parameters)
    assert read is not None
    theta, times = np.full(parameters, -0.3), np.linspace(0.0, 1.0, 9)
    np.testing.assert_allclose(read.over_time(theta)(times), residual.over_time(theta)(times), atol=1e-8)
    wrong = {"weight from 0 to 1": ("share", np.array([1.5])), "order 2 or 6": ("order", np.array([2.5]))}
    for message, (name, value) in wrong.items():
        with pytest.raises(ValueError, match=message):
            parameter_residual({**arrays, f"correction.shift.{name}": value}, size, parameters)
    with pytest.raises(ValueError, match="shape"):
        parameter_residual(arrays, size + 1, parameters)
    broken = {name: np.full(array.shape, np.nan) for name, array in arrays.items()}
    with pytest.raises(ValueError, match="finite"):
        parameter_residual(broken, size, parameters)
