"""One model for each object of a data set, in one checkpoint."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pushes import body, in_folder, pushes

from odeform.checkpoint import write_checkpoint
from odeform.cli import main
from odeform.cli.evaluate import _table
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.models.base import Predictor
from odeform.models.per_object import PerObject
from odeform.models.registry import load
from odeform.training.train import train


@pytest.fixture(scope="module")
def dataset() -> Dataset:
    return pushes()


@pytest.fixture(scope="module")
def nearest(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Predictor:
    return train(dataset, tmp_path_factory.mktemp("models") / "nearest.safetensors", "nearest", report=lambda _: None)


def test_a_model_of_one_object_is_that_of_all_for_it(dataset: Dataset, nearest: Predictor, tmp_path: Path) -> None:
    one = train(dataset, tmp_path / "one.safetensors", "nearest", objects=["plate"], report=lambda _: None)
    assert one.schema.objects == ("plate",)
    # the others are not scored: it does not know them
    scores = evaluate(one, dataset, "test")["per_object"]
    assert scores == {"plate": evaluate(nearest, dataset, "test")["per_object"]["plate"]}


def test_every_object_has_its_own_model(dataset: Dataset, nearest: Predictor) -> None:
    assert isinstance(nearest, PerObject)
    assert nearest.model == "nearest"
    assert nearest.schema.objects == ("egg", "plate")
    for name in nearest.schema.objects:
        assert np.array_equal(nearest.rest_of({"object": name}).points, body(name).points)
        truth = next(dataset.sequences("train", name))
        predicted = nearest.solve(None, truth.parameters).vertices(truth.times)
        assert np.abs(predicted - truth.vertices).max() < 2e-4, "a training motion is found again"
    assert np.array_equal(nearest.rest.points, body("egg").points)
    assert nearest.solve().parameters["object"] == "egg"
    with pytest.raises(InputError, match="unknown object 'cow'"):
        nearest.solve(None, {"object": "cow"})


def test_it_predicts_as_a_model_of_one_object_alone(tmp_path: Path) -> None:
    """With the same error band, which takes at least eight validation sequences."""
    dataset = pushes(80)
    alone, nearest = (
        train(data, tmp_path / f"{index}.safetensors", "nearest", report=lambda _: None)
        for index, data in enumerate((dataset.of("plate"), dataset))
    )
    assert alone.schema.objects == ("plate",)
    for truth in dataset.sequences("val", "plate"):
        one, other = (model.solve(None, truth.parameters) for model in (alone, nearest))
        assert np.array_equal(one.vertices(truth.times), other.vertices(truth.times))
        band = alone.error_band(truth.parameters, truth.times)
        assert band is not None
        assert np.array_equal(band, nearest.error_band(truth.parameters, truth.times))


@pytest.mark.parametrize("model", ["pod-rbf", pytest.param("gp", marks=pytest.mark.slow)])
def test_fitted_models_learn_each_object(dataset: Dataset, nearest: Predictor, model: str, tmp_path: Path) -> None:
    predictor = train(dataset, tmp_path / "model.safetensors", model, report=lambda _: None)
    assert isinstance(predictor, PerObject)
    scores, least = predictor.checkpoint.scores, nearest.checkpoint.scores
    for name in dataset.objects:
        assert scores["per_object"][name]["rmse_pooled_mm"] < least["per_object"][name]["rmse_pooled_mm"]


@pytest.mark.slow
def test_networks_on_points_learn_each_object(dataset: Dataset, tmp_path: Path) -> None:
    lines: list[str] = []
    predictor = train(dataset, tmp_path / "direct.safetensors", "direct", steps=20, report=lines.append)
    assert isinstance(predictor, PerObject)
    assert {line.split(":")[0] for line in lines} >= {"egg", "plate"}


def test_scores_of_each_object(dataset: Dataset, nearest: Predictor) -> None:
    whole = evaluate(nearest, dataset, "test")
    each = {name: evaluate(nearest, dataset.of(name), "test") for name in dataset.objects}
    shared = ("rmse_mm", "rmse_pooled_mm", "deformation_relative", "off_grid_rmse_mm", "coverage_90", "sequences")
    for name, alone in each.items():
        assert {key: whole["per_object"][name][key] for key in shared} == {key: alone[key] for key in shared}
    assert whole["sequences"] == sum(alone["sequences"] for alone in each.values())
    pooled = [alone["mse_pooled_mm2"] for alone in each.values()]
    assert whole["mse_pooled_mm2"] == pytest.approx(np.mean(pooled))
    for key in ("rmse_pooled_mm", "deformation_relative"):
        assert whole["mean_of_objects"][key] == pytest.approx(np.mean([alone[key] for alone in each.values()]))


def test_the_table_has_a_row_for_each_object(dataset: Dataset, nearest: Predictor) -> None:
    lines = _table({"nearest": evaluate(nearest, dataset, "test")}).splitlines()
    assert [line[:24].rstrip() for line in lines[1:]] == ["nearest", "  egg", "  plate", "  mean of 2 objects"]


def test_on_the_command_line(dataset: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data, model, scores = (str(tmp_path / name) for name in ("pushes", "m.safetensors", "scores.json"))
    in_folder(dataset, Path(data))
    assert main(["train", data, "--out", model, "--model", "nearest"]) == 0
    assert main(["evaluate", model, "--data", data, "--json", scores]) == 0
    assert set(json.loads(Path(scores).read_text())["models"]["nearest"]["per_object"]) == {"egg", "plate"}
    out = str(tmp_path / "motion.npz")
    settings = ["object=plate", "contact=0,0,0.04", "force=0,0,-5"]
    assert main(["predict", model, "--out", out, "--set", *settings]) == 0
    assert f" {len(body('plate').points)} points" in capsys.readouterr().out
    with np.load(out) as arrays:
        assert json.loads(str(arrays["parameters"]))["object"] == "plate"
    assert main(["info", model]) == 0
    assert main(["predict", model, "--out", out, "--set", "object=cow"]) == 2


def test_a_checkpoint_without_one_of_its_objects_is_refused(nearest: Predictor, tmp_path: Path) -> None:
    checkpoint = nearest.checkpoint
    arrays = {key: array for key, array in checkpoint.arrays.items() if not key.startswith("plate/pose")}
    write_checkpoint(tmp_path / "a.safetensors", replace(checkpoint, arrays=arrays))
    with pytest.raises(InputError, match="missing or wrong 'pose'"):
        load(tmp_path / "a.safetensors")
