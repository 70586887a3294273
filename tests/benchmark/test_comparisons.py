from typing import cast

import pytest

from odeform.benchmark import comparisons
from odeform.benchmark.precision import operating_points
from odeform.models.base import Predictor
from odeform.models.latent.model import LatentModel


@pytest.fixture
def model(predictors: dict[str, Predictor]) -> LatentModel:
    return cast(LatentModel, predictors["odeform"])


def test_torchdiffeq_solves_the_same_equation(model: LatentModel) -> None:
    row = comparisons.torchdiffeq_comparison(model, operating_points(model, None)[0])
    assert row["error_mm"] < 20.0  # for a model that was trained for seconds, at its balanced quality
    assert row["evaluations"] > 10
    assert row["speedup"] == pytest.approx(row["ms"] / row["ours_ms"])
