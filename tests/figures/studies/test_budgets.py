from dataclasses import replace

import numpy as np
import pytest

import odeform
from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.models.points.point_network import Trial
from odeform.models.points.training.fit import fit_points
from odeform.models.points.training.point_data import prepare_points
from odeform.models.registry import load_model, model_class
from odeform.models.training.request import TrainRequest
from odeform.models.training.run import Run, with_ranges_of_data
from odeform_figures.studies.budgets import Bodies


@pytest.fixture(scope="module")
def few() -> Dataset:
    whole = odeform.open_dataset("contact-force").of("bottle", "donut")
    return replace(whole, entries=whole.entries[::12])


@pytest.mark.parametrize("model", ["rnn", "odeform-per-point", "node"])
def test_networks_that_are_trained_at_once_are_those_trained_one_by_one(
    model: str, few: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    kind = model_class(model)
    network = kind.network
    monkeypatch.setattr(network, "trials", (Trial(1e-3, 8), Trial(3e-3, 8), Trial(3e-3, 12)), raising=False)
    monkeypatch.setattr(network, "work", 256, raising=False)
    stacked = Bodies(model, few, device="cpu").train(32)
    for name in few.objects:
        dataset = with_ranges_of_data(few.of(name))
        run = Run(dataset, TrainRequest(model, steps=16), {}, None, lambda _: None, device="cpu")
        alone = fit_points(network, prepare_points(dataset, FrameSubsampling()), run)
        together = stacked.config["objects"][name]
        assert (together["rate"], together["width"]) == (alone.config["rate"], alone.config["width"])
        assert together["val"]["steps"] == alone.config["val"]["steps"] == 10
        for one, other in zip(together["trials"], alone.config["trials"], strict=True):
            assert one["val"] == pytest.approx(other["val"], rel=1e-5)
        assert together["val"]["val_rmse_mm"] == pytest.approx(alone.config["val"]["val_rmse_mm"], rel=1e-3)
    assert load_model(stacked).solve(parameters={"object": "donut"}).vertices(0.1).shape[1] == 3


def test_the_next_budget_does_not_depend_on_the_one_before(few: Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    network = model_class("rnn").network
    monkeypatch.setattr(network, "trials", (Trial(3e-3, 8),), raising=False)
    monkeypatch.setattr(network, "work", 64, raising=False)
    bodies = Bodies("rnn", few, device="cpu")
    bodies.train(24)
    again, alone = bodies.train(16), Bodies("rnn", few, device="cpu").train(16)
    assert all(np.array_equal(again.arrays[name], alone.arrays[name]) for name in again.arrays)
