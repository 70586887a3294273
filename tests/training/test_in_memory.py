"""Training on arrays, without files: data sets, losses, devices, and states that trainings continue from."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import odeform
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.geometry.primitives import octasphere
from odeform.models.points.direct import Direct
from odeform.models.points.point_network import Trial

BALL = octasphere(0.1, 3)
TIMES = np.arange(13) / 30.0


class Springs(torch.nn.Module):
    """y'' = -w^2 (y - y0), with w and y0 linear in the parameters."""

    def __init__(self, parameters: int, coordinates: int) -> None:
        super().__init__()
        self.pull = torch.nn.Linear(2 * coordinates + parameters, coordinates)

    def initial_state(self, theta: torch.Tensor) -> torch.Tensor:
        return theta.new_zeros(len(theta), 2 * self.pull.out_features)

    def vector_field(self, t: float, z: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        return torch.cat([z.chunk(2, dim=1)[1], 10.0 * self.pull(torch.cat([z, theta], dim=1))], dim=1)

    def readout(self, t: torch.Tensor, z: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        return z.chunk(2, dim=1)[0]


class SpringModel(odeform.NeuralModel):
    model, network = "springs", Springs


odeform.register_model("springs", SpringModel)


class Energy(torch.nn.Module):
    """q' = dH/dp, p' = -dH/dq, with an energy H of the state and the parameters."""

    def __init__(self, parameters: int, coordinates: int) -> None:
        super().__init__()
        self.energy = torch.nn.Sequential(
            torch.nn.Linear(2 * coordinates + parameters, 8), torch.nn.Tanh(), torch.nn.Linear(8, 1)
        )
        self.start = torch.nn.Linear(parameters, 2 * coordinates)

    def initial_state(self, theta: torch.Tensor) -> torch.Tensor:
        return self.start(theta)

    def vector_field(self, t: float, z: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        with torch.enable_grad():
            at = z if z.requires_grad else z.detach().requires_grad_()
            energy = self.energy(torch.cat([at, theta], dim=1)).sum() + at.square().sum()
            (slope,) = torch.autograd.grad(energy, at, create_graph=True)
        by_position, by_momentum = slope.chunk(2, dim=1)
        return 4.0 * torch.cat([by_momentum, -by_position], dim=1)

    def readout(self, t: torch.Tensor, z: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        return z.chunk(2, dim=1)[0]


class EnergyModel(odeform.NeuralModel):
    model, network = "energy", Energy


odeform.register_model("energy", EnergyModel)


class SingleOnly(Springs):
    """Fails in double precision, in which solutions are compared: its matrix is no buffer."""

    def vector_field(self, t: float, z: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        return super().vector_field(t, z @ torch.eye(z.shape[1]), theta)


class SingleOnlyModel(odeform.NeuralModel):
    model, network = "single-only", SingleOnly


odeform.register_model("single-only", SingleOnlyModel)


def arrays(count: int = 20) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Balls that bob on a spring and flatten."""
    stiffness = np.linspace(20.0, 60.0, count)
    swing = 1.0 - np.cos(np.sqrt(stiffness)[:, None] * TIMES)
    stretch = 1.0 + 0.05 * swing[..., None, None] * np.array([-0.5, -0.5, 1.0])
    return BALL.points * stretch + 0.05 * swing[..., None, None] * np.array([0.0, 0.0, 1.0]), {"stiffness": stiffness}


@cache
def balls() -> Dataset:
    vertices, parameters = arrays()
    return odeform.dataset_from_arrays(
        TIMES, vertices, parameters, BALL.faces, units={"stiffness": "N/m"}, log=["stiffness"]
    )


def quiet(_: str) -> None: ...


def weights_of(predictor: odeform.Predictor) -> Mapping[str, np.ndarray]:
    return {name: array for name, array in predictor.checkpoint.arrays.items() if name.startswith("net.")}


def same(one: odeform.Predictor, other: odeform.Predictor) -> bool:
    return all(np.array_equal(array, weights_of(other)[name]) for name, array in weights_of(one).items())


def test_arrays_are_a_data_set() -> None:
    dataset, (vertices, parameters) = balls(), arrays()
    assert [len(dataset.select(split)) for split in ("train", "val", "test")] == [14, 2, 4]
    (stiffness,) = dataset.schema.parameters
    assert (stiffness.unit, stiffness.low, stiffness.high, stiffness.scale) == ("N/m", 20.0, 60.0, "log")
    assert (dataset.schema.window.stop, dataset.schema.window.rate) == pytest.approx((0.4, 30.0))
    for index, sequence in enumerate(dataset.sequences("all")):
        assert np.array_equal(sequence.vertices, vertices[index].astype(np.float32))
        assert sequence.parameters["stiffness"] == parameters["stiffness"][index]
        assert sequence.weights.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"times": TIMES[1:]}, "vertices: expected shape"),
        ({"times": TIMES**2}, "times: expected seconds that are evenly spaced from 0"),
        ({"parameters": {"stiffness": np.ones(3)}}, "parameters: expected stiffness of shape"),
        ({"parameters": {"stiffness": np.ones(20)}}, "parameter stiffness: expected finite low < high"),
        ({"units": {"mass": "kg"}}, "units: unknown parameter 'mass'"),
        ({"splits": ["train"] * 19 + ["exam"]}, "splits: expected 20 of train, val, test"),
        ({"surroundings": odeform.Surroundings(gravity=np.inf)}, "surroundings: expected finite numbers"),
        ({"vertices": np.full((20, 13, len(BALL.points), 3), np.nan)}, "vertices, motion_0000"),
    ],
)
def test_other_arrays_are_refused(change: dict[str, Any], said: str) -> None:
    vertices, parameters = arrays()
    given = {"times": TIMES, "vertices": vertices, "parameters": parameters, "faces": BALL.faces}
    with pytest.raises(InputError, match=said):
        odeform.dataset_from_arrays(**{**given, **change})


def test_arrays_of_a_scene_of_ones_own_may_have_a_floor(tmp_path: Path) -> None:
    vertices, parameters = arrays()
    around = odeform.Surroundings(floor=float(BALL.points[:, 2].min()), gravity=1.6)
    dataset = odeform.dataset_from_arrays(TIMES, vertices, parameters, BALL.faces, surroundings=around)
    odeform.fit(dataset, "nearest", report=quiet).save(tmp_path / "moon.safetensors")
    moon, unknown = odeform.load(tmp_path / "moon.safetensors"), odeform.fit(balls(), "nearest", report=quiet)
    assert moon.surroundings == around
    assert (moon.validity.limits.floor, moon.validity.limits.gravity) == (around.floor, 1.6)
    assert (unknown.surroundings, unknown.validity.limits.floor) == (None, None)


def test_nothing_is_written_unless_it_is_saved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    predictor = odeform.fit(balls(), "gp", report=quiet)
    assert list(tmp_path.iterdir()) == []
    assert predictor.checkpoint.scores["rmse_pooled_mm"] < 0.5
    predictor.save("gp.safetensors")
    assert np.array_equal(odeform.load("gp.safetensors").solve().vertices(0.2), predictor.solve().vertices(0.2))


def test_a_resumed_vector_field_is_the_same_as_one_that_was_not_interrupted(tmp_path: Path) -> None:
    part, lines = tmp_path / "state.part", []
    whole = odeform.fit(balls(), "springs", steps=6, report=quiet)

    def interrupt(line: str) -> None:
        if "step 3:" in line:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        odeform.fit(balls(), "springs", steps=6, resume=part, report=interrupt)
    resumed = odeform.fit(balls(), "springs", steps=6, resume=part, report=lines.append)
    assert any(line.startswith("continues after") for line in lines)
    assert same(resumed, whole)
    assert resumed.checkpoint.config["val"]["steps"] == 6
    with pytest.raises(InputError, match="state of another training"):
        odeform.fit(balls(), "springs", steps=8, seed=1, resume=part, report=quiet)
    part.write_bytes(b"no state")
    with pytest.raises(InputError, match="not a state of a training"):
        odeform.fit(balls(), "springs", steps=8, resume=part, report=quiet)


def test_a_vector_field_may_be_the_derivative_of_an_energy() -> None:
    fitted = odeform.fit(balls(), "energy", steps=3, report=quiet)
    assert np.isfinite(fitted.solve().vertices(TIMES)).all()


def test_a_module_that_cannot_predict_is_found_before_it_is_trained() -> None:
    lines: list[str] = []
    with pytest.raises(RuntimeError, match="dtype"):
        odeform.fit(balls(), "single-only", steps=3, report=lines.append)
    assert not any("step" in line for line in lines)


def test_where_a_score_counts_frames_that_were_not_trained_it_says_so() -> None:
    lines: list[str] = []
    odeform.fit(balls(), "nearest", window=(0, 7), report=lines.append)
    assert lines[-1].startswith("test: pooled RMSE ")
    assert lines[-1].endswith(", with frames outside of 0:7")


@pytest.mark.slow
def test_resumed_models_of_points_are_the_same_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Direct.network, "trials", (Trial(1e-2, 16), Trial(3e-3, 16)), raising=False)
    part, seen = tmp_path / "state.part", []
    whole = odeform.fit(balls(), "direct", steps=140, report=quiet)

    def interrupt(line: str) -> None:
        seen.append(line)
        if line.startswith("rate") and len([s for s in seen if s.startswith("rate")]) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        odeform.fit(balls(), "direct", steps=140, resume=part, report=interrupt)
    assert same(odeform.fit(balls(), "direct", steps=140, resume=part, report=quiet), whole)


def test_a_loss_of_ones_own_decides_what_is_learned() -> None:
    shapes = set()

    def lazy(predicted: torch.Tensor, truth: torch.Tensor, weights: torch.Tensor) -> torch.Tensor:
        shapes.add((predicted.shape == truth.shape, predicted.shape[:-1] == weights.shape))
        return predicted.square().mean()  # the best is not to move

    lazy_one = odeform.fit(balls(), "springs", steps=5, loss=lazy, report=quiet)
    assert shapes == {(True, True)}
    assert not same(lazy_one, odeform.fit(balls(), "springs", steps=5, report=quiet))


@pytest.mark.slow
@pytest.mark.parametrize("model", ["latent", "direct"])
def test_a_loss_sees_metres(model: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Direct.network, "trials", (Trial(1e-2, 16),), raising=False)
    largest = []

    def loss(predicted: torch.Tensor, truth: torch.Tensor, weights: torch.Tensor) -> torch.Tensor:
        largest.append(float(truth.abs().max()))
        assert predicted.shape[:-1] == weights.shape
        return (weights[..., None] * (predicted - truth).abs()).mean()

    without = ("random-features", "residual") if model == "latent" else ()
    odeform.fit(balls(), model, steps=3, loss=loss, without=without, report=quiet)
    assert 0.02 < max(largest) < 0.2  # bodies move by up to 0.1 m, 0.05 of it in the mean


@pytest.mark.parametrize("setting", [{"loss": lambda *_: 0.0}, {"device": "cpu"}], ids=["loss", "device"])
@pytest.mark.parametrize("model", ["gp", "rolling", "nearest"])
def test_least_squares_take_neither_a_loss_nor_a_device(model: str, setting: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=f"{next(iter(setting))}: {model} is fitted by least squares"):
        odeform.fit(balls(), model, report=quiet, **setting)


def test_a_device_that_is_not_there_is_named() -> None:
    with pytest.raises(InputError, match="device: expected one that PyTorch finds here"):
        odeform.fit(balls(), "springs", steps=1, device="abacus", report=quiet)


def test_closed_forms_need_no_state(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="resume: a training of gp keeps no state"):
        odeform.fit(balls(), "gp", resume=tmp_path / "gp.part", report=quiet)
    with pytest.raises(InputError, match="resume: a training of gp keeps no state"):
        odeform.train(balls(), tmp_path / "gp.safetensors", "gp", resume=True, report=quiet)


@pytest.mark.parametrize(
    ("name", "model", "said"),
    [
        ("gp", SpringModel, "'gp' is a model of ODeform"),
        ("odeform", SpringModel, "'odeform' is a model of ODeform"),
        ("mine", SpringModel, "expected SpringModel.model = 'mine'"),
        ("springs", Springs, "expected a subclass of odeform.Predictor"),
    ],
)
def test_names_of_models_are_checked(name: str, model: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        odeform.register_model(name, model)
