from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import torch

from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.dataset.training_data import TrainingData, prepare
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.models.base import Predictor
from odeform.models.latent.inference import make_decoder, make_encoder, make_field, pool_shape
from odeform.models.latent.network import ODeformNet
from odeform.models.latent.training import fit as odeform_training
from odeform.models.latent.training.config import TrainConfig
from odeform.models.latent.training.fit import train_latent
from odeform.models.latent.training.loop import network_weights, train_network
from odeform.models.latent.training.start import build_network
from odeform.models.latent.training.trainer import Trainer
from odeform.models.training.body import body_arrays
from odeform.models.training.request import TrainRequest
from odeform.models.training.run import Run
from odeform.solver.integrate import SolverSettings, integrate
from odeform.training.train import train


@pytest.fixture(scope="module")
def data(dataset: Dataset) -> TrainingData:
    return prepare(dataset, modes=8)


def silent(_: str) -> None: ...


def test_a_seed_makes_one_network(data: TrainingData) -> None:
    one, two, other = (network_weights(build_network(data, seed)) for seed in (5, 5, 6))
    assert all(np.array_equal(one[name], two[name]) for name in one)
    name = "local_field.0.weight"
    assert not np.array_equal(one[name], other[name])


def test_outputs_are_whitened(data: TrainingData) -> None:
    """Each part of y comes out of order one: shifts alike, turns alike, every mode for itself."""
    gains = build_network(data, 0).gains.numpy()
    assert len(set(gains[:3])) == len(set(gains[3:6])) == 1
    whitened = data.reduced["train"] / gains
    assert (whitened[..., :3] ** 2).mean(axis=(0, 1)).sum() == pytest.approx(1.0, rel=1e-4)
    assert (whitened[..., 3:6] ** 2).mean(axis=(0, 1)).sum() == pytest.approx(1.0, rel=1e-4)
    assert (whitened[..., 6:] ** 2).mean(axis=(0, 1)) == pytest.approx(np.ones(8), rel=1e-4)


@pytest.mark.parametrize("stagger", [False, True])
def test_descent_sees_as_many_frames_where_few_are_known(dataset: Dataset, stagger: bool) -> None:
    data = prepare(dataset, 8, FrameSubsampling(every=6, stagger=stagger))
    config = TrainConfig(batch=2)
    trainer = Trainer(build_network(data, 0), data, config, torch.device("cpu"))
    assert trainer.batch * len(trainer.visible) >= config.batch * len(data.times) / 2 - len(trainer.visible)
    # what a spline filled in changes nothing
    rows, losses = torch.arange(trainer.batch), []
    for filled in (0.0, 1e3):
        reduced = data.reduced["train"] + filled * ~data.observed["train"][..., None]
        other = replace(data, reduced={**data.reduced, "train": reduced})
        trainer = Trainer(build_network(data, 0), other, config, torch.device("cpu"))
        trainer.loss(rows, trainer.frames // 2)
        losses.append(trainer.net.local_decoder.readout.weight.clone())
    assert torch.equal(*losses)


def test_descent_lowers_what_the_readout_leaves(data: TrainingData) -> None:
    """Of the training sequences: these few say little about any other."""
    trainer = Trainer(build_network(data, 0), data, TrainConfig(), torch.device("cpu"))
    errors = []
    for steps in (0, 40):
        for step in range(steps):
            trainer.advance(step / steps)
        trainer.solve_readout(1e-6)
        errors.append(trainer.errors_mm("train"))
    assert errors[1][0] < 0.8 * errors[0][0]
    assert errors[1][1] < errors[0][1]


def test_the_readout_is_the_least_squares_one(data: TrainingData) -> None:
    """No small change of the readout lowers the training error."""
    net = build_network(data, 0)
    train_network(net, data, TrainConfig(steps=0, random_features=0), silent)
    trainer = Trainer(net, data, TrainConfig(), torch.device("cpu"))
    best = np.square(trainer.errors_mm("train"))
    generator = torch.Generator().manual_seed(0)
    for index, decoder in enumerate(net.decoders):
        solved = decoder.readout.weight.data.clone()
        for _ in range(3):
            change = torch.randn(solved.shape, generator=generator) * solved.abs().mean()
            for sign in (-0.02, 0.02):
                decoder.readout.weight.data = solved + sign * change
                assert trainer.errors_mm("train")[index] ** 2 > best[index]
        decoder.readout.weight.data = solved


def test_random_features_leave_less(data: TrainingData) -> None:
    """Of the training sequences, the more of them the less; and what a checkpoint keeps says the same."""
    left = []
    for count in (0, 100, 400):
        net = build_network(data, 0)
        config = TrainConfig(steps=2, random_features=count, sharpnesses=(1.0,), ridges=(1e-10,))
        train_network(net, data, config, silent)
        weights = network_weights(net)
        assert all(w.dtype == np.float32 for name, w in weights.items() if not name.endswith("readout.weight"))
        pooled = pool_shape(weights, net.config, data.rest / data.space.gyration_radius, data.weights)
        squares = []
        for theta, truth in zip(data.theta["train"], data.reduced["train"], strict=True):
            start = make_encoder(weights, net.config)(pooled, theta, np.float64)
            field = make_field(weights, net.config, np.float64)(theta)
            stop = float(data.times[-1])
            solution = integrate(field, start, SolverSettings("rk4", step=float(data.times[1]) / 2.0), stop)
            y = make_decoder(weights, net.config)(theta)(data.times, solution.sample(data.times))
            squares.append((((y - y[0] - truth)[:, 6:]) ** 2).mean())
        left.append(np.sqrt(np.mean(squares)))
    assert left[1] < 0.95 * left[0]
    assert left[2] < 0.95 * left[1]


def test_resumes_where_it_was_interrupted(data: TrainingData, tmp_path: Path) -> None:
    """Steps in two sittings are the steps of one, bit for bit."""
    part = tmp_path / "a.part"

    def steps(count: int, resume: bool) -> dict[str, np.ndarray]:
        net = build_network(data, 0)
        trainer = Trainer(net, data, TrainConfig(batch=8), torch.device("cpu"))
        if resume:
            trainer.restore(part)
        for _ in range(count):
            trainer.advance(0.5)
        trainer.save(part)
        return network_weights(net)

    whole = steps(4, resume=False)
    steps(2, resume=False)
    again = steps(2, resume=True)
    assert all(np.array_equal(whole[name], again[name]) for name in whole)


def test_steps_are_a_budget_that_repeats(data: TrainingData) -> None:
    """Whatever the machine does meanwhile."""
    nets = [build_network(data, 0) for _ in range(2)]
    config = TrainConfig(steps=3, batch=8, random_features=40)
    assert [train_network(net, data, config, silent)["steps"] for net in nets] == [3, 3]
    one, two = (network_weights(net) for net in nets)
    assert all(np.array_equal(one[name], two[name]) for name in one)


def test_the_processor_is_left_as_it_was(data: TrainingData) -> None:
    train_network(build_network(data, 0), data, TrainConfig(steps=1, batch=8, random_features=0), silent)
    assert np.nextafter(0.0, 1.0) * np.ones(1) > 0.0


def test_an_interruption_leaves_what_resume_wants(data: TrainingData, tmp_path: Path) -> None:
    part = tmp_path / "a.part"

    def interrupt(line: str) -> None:
        if "step" in line:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_network(build_network(data, 0), data, TrainConfig(minutes=1.0, report=0.0), interrupt, part)
    lines: list[str] = []
    config = TrainConfig(minutes=0.0, random_features=40)
    train_network(build_network(data, 0), data, config, lines.append, part, resume=True)
    assert "continues after" in lines[0]
    part.write_bytes(part.read_bytes()[:200])
    with pytest.raises(InputError, match="resume"):
        train_network(build_network(data, 0), data, config, silent, part, resume=True)


def test_resume_without_a_trace(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="part"):
        train(dataset, tmp_path / "a", resume=True)


def test_descent_does_not_depend_on_validation_data(data: TrainingData) -> None:
    """Whitening, steps of descent and readouts are the same when the validation motions are noise."""
    noise = np.random.default_rng(0).normal(size=data.reduced["val"].shape)
    noisy = replace(data, reduced={**data.reduced, "val": noise})
    config = TrainConfig(steps=3, batch=8, random_features=0)
    trained = []
    for some in (data, noisy):
        net = build_network(some, 0)
        fresh = net.local_field[0].weight.detach().clone().numpy()
        errors = train_network(net, some, config, silent)
        trained.append((network_weights(net), errors["val_deformation_rmse_mm"]))
    (one, error), (two, noisy_error) = trained
    assert all(np.array_equal(one[name], two[name]) for name in one)
    assert not np.array_equal(one["local_field.0.weight"], fresh)
    assert error != noisy_error


def test_a_checkpoint_records_the_settings_that_were_used(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    used: list[TrainConfig] = []

    def spy(net: ODeformNet, data: TrainingData, config: TrainConfig, *rest: object) -> dict[str, float]:
        used.append(config)
        return train_network(net, data, replace(config, random_features=0), silent)

    monkeypatch.setattr(odeform_training, "train_network", spy)
    request = TrainRequest(steps=1, seed=4)
    settings = train_latent(Run(dataset, request, body_arrays(dataset), tmp_path / "a.part", silent)).config
    assert settings["training"] == asdict(used[0])
    assert (settings["training"]["steps"], settings["training"]["seed"]) == (1, 4)
    assert settings["val"]["batch"] == used[0].batch


def test_scores_are_those_of_the_file(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    for predictor in predictors.values():
        again = evaluate(predictor, dataset, "test")
        for name in ("rmse_pooled_mm", "deformation_relative", "parameters"):
            assert predictor.checkpoint.scores[name] == pytest.approx(again[name], rel=1e-6)


def test_a_checkpoint_says_where_it_comes_from(predictors: dict[str, Predictor]) -> None:
    provenance = predictors["odeform"].checkpoint.provenance
    assert provenance["dataset"]["seed"] == 3
    assert provenance["seed"] == 1
    assert provenance["fixed"]["radius_m"] == 0.1
    assert provenance["versions"]["torch"] == torch.__version__
    assert provenance["command"][1].startswith("odeform train")


def trained_on(
    dataset: Dataset, tmp_path: Path, window: tuple[int, int] | None, every: int = 1, report: Callable = silent
) -> Predictor:
    path = tmp_path / "nearest.safetensors"
    return train(dataset, path, "nearest", window=window, every=every, report=report)


def test_part_of_the_frames(dataset: Dataset, tmp_path: Path) -> None:
    predictor = trained_on(dataset, tmp_path, window=(0, 41), every=4)
    assert np.allclose(predictor.schema.window.times, np.arange(11) / 30.0)
    scores = evaluate(predictor, dataset, "train", window=(0, 41))
    # frame 0 is given and has no score, so frame 4 is number 3
    by_frame = np.array(scores["per_frame_rmse_mm"])
    shown = np.arange(1, 41) % 4 == 0
    assert by_frame[shown].max() < 0.1
    # the frames in between were never shown, and are known apart
    assert scores["off_grid_rmse_mm"] == pytest.approx(np.sqrt((by_frame[~shown] ** 2).mean()))
    assert 0.1 < scores["off_grid_rmse_mm"] < 20.0


def test_window_that_starts_late_is_refused(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="start at frame 0"):
        trained_on(dataset, tmp_path, window=(10, 41))


@pytest.mark.parametrize(("window", "every"), [((500, 600), 1), ((120, 121), 1), (None, 121), (None, 0), (None, -1)])
def test_frames_that_are_not_there(
    dataset: Dataset, tmp_path: Path, window: tuple[int, int] | None, every: int
) -> None:
    with pytest.raises(InputError):
        trained_on(dataset, tmp_path, window, every)


def test_unknown_model(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="oracle"):
        train(dataset, tmp_path / "a", "oracle")
    assert not (tmp_path / "a").exists()
