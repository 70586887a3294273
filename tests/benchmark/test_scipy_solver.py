from typing import cast

import pytest

from odeform.benchmark.precision import operating_points
from odeform.benchmark.scipy_solver import TOLERANCES, loosest, scipy_comparison
from odeform.models.base import Predictor
from odeform.models.latent.model import LatentModel


def test_the_loosest_tolerance_that_is_exact_enough() -> None:
    assert loosest(lambda tolerance: 2.0 * tolerance, 1e-4) == pytest.approx(3.16e-5, rel=0.01)
    assert loosest(lambda _: 1.0, 0.5) is None
    assert loosest(lambda _: 0.0, 0.5) == TOLERANCES[0]


def test_scipy_solves_the_same_equation_as_exactly(predictors: dict[str, Predictor]) -> None:
    model = cast(LatentModel, predictors["odeform"])
    row = scipy_comparison(model, operating_points(model, None)[0])
    ours = float(row["note"].split("ours has ")[1].split(" mm")[0])
    assert row["error_mm"] <= 1.01 * ours
    assert row["speedup"] == pytest.approx(row["ms"] / row["ours_ms"])
