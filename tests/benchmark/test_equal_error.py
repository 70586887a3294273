from typing import cast

import numpy as np
import pytest

from odeform.benchmark import equal_error
from odeform.dataset.index import Dataset
from odeform.models.base import Predictor
from odeform.models.latent.model import LatentModel
from odeform.simulation.scenes.registry import get_scene

pytestmark = pytest.mark.slow


@pytest.fixture
def model(predictors: dict[str, Predictor]) -> LatentModel:
    return cast(LatentModel, predictors["odeform"])


def test_a_motion_transferred_to_its_own_mesh_is_unchanged(dataset: Dataset, model: LatentModel) -> None:
    sequence = next(dataset.sequences("val")).until(0.3)
    azimuth = model.schema.azimuth(sequence.parameters)
    carried = equal_error.carried_over(sequence, sequence, model.space.anchor, azimuth)
    assert np.abs(sequence.vertices[-1] - sequence.vertices[0]).max() > 0.05
    assert np.abs(carried - sequence.vertices).max() < 1e-6


@pytest.mark.usefixtures("coarse")
def test_a_coarser_simulation_has_a_larger_error(
    dataset: Dataset, model: LatentModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The fixture's scene has 4 segments and steps of 2 ms; its data set is the truth of that setting."""
    scene = get_scene("kick")
    monkeypatch.setattr(equal_error, "SIMULATED", 1)
    monkeypatch.setattr(equal_error, "STEPS", (1.0, 2.0))
    row = equal_error.simulator(model, dataset)
    same, coarser = row["tried"]
    assert (same["step"], same["segments"]) == (scene.step, 4)
    assert same["error_mm"] < 1e-3 < coarser["error_mm"]
    enough = [one for one in row["tried"] if one["error_mm"] <= row["ours_error_mm"]]
    assert row["ms"] == min(one["ms"] for one in enough)
    spent = 21 * same["ms"] + 1e3 * model.checkpoint.provenance["training_seconds"]
    assert (row["pays_off_after"] - 1) * (row["ms"] - row["ours_ms"]) < spent
    assert row["pays_off_after"] * (row["ms"] - row["ours_ms"]) >= spent


def test_a_missing_data_set_is_the_reason_for_skipping(model: LatentModel) -> None:
    assert "--data" in equal_error.simulator(model, None)["skipped"]
