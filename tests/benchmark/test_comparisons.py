from typing import cast

import pytest

from odeform.benchmark import comparisons
from odeform.benchmark.precision import find_places
from odeform.models.base import Predictor
from odeform.models.odeform.model import ODeform


@pytest.fixture
def model(predictors: dict[str, Predictor]) -> ODeform:
    return cast(ODeform, predictors["odeform"])


def test_torchdiffeq_solves_the_same_equation(model: ODeform) -> None:
    row = comparisons.torchdiffeq_peer(model, find_places(model, None)[0])
    assert row["error_mm"] < 20.0  # of a model that was taught for seconds, at its balanced quality
    assert row["evaluations"] > 10
    assert row["speedup"] == pytest.approx(row["ms"] / row["ours_ms"])
