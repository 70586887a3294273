from typing import cast

import numpy as np
import pytest

from odeform.benchmark.precision import OperatingPoint, ladder, measure, operating_points
from odeform.benchmark.probes import nearest_sequences
from odeform.dataset.index import Dataset
from odeform.evaluation.metrics import evaluate
from odeform.models.base import Predictor
from odeform.models.latent.model import LatentModel
from odeform.solver.integrate import SolverSettings


@pytest.fixture(scope="module")
def model(predictors: dict[str, Predictor]) -> LatentModel:
    return cast(LatentModel, predictors["odeform"])


@pytest.fixture(scope="module")
def points(model: LatentModel, dataset: Dataset) -> list[OperatingPoint]:
    return operating_points(model, dataset)


def test_operating_points_are_the_default_and_a_corner(points: list[OperatingPoint], model: LatentModel) -> None:
    default, corner = points
    assert default.parameters == model.schema.complete(None)
    assert np.allclose(np.abs(model.schema.vector(corner.parameters)), 1.0)
    for point in points:
        # a tighter tolerance does not move the converged motion
        assert 0.0 < point.unsure_mm < 1e-4
        assert point.exact.shape[0] == len(model.schema.window.times)


def test_the_model_error_is_that_of_the_converged_solution(
    points: list[OperatingPoint], model: LatentModel, dataset: Dataset
) -> None:
    near = nearest_sequences(dataset, points[0].parameters, len(points[0].sequences))
    assert [entry.name for entry in near.entries] == list(points[0].sequences)
    close = evaluate(model, near, "test", quality=SolverSettings("dopri5", tolerance=1e-9, dtype="float64"))
    assert points[0].model_error_mm == pytest.approx(close["rmse_pooled_mm"], rel=1e-4)
    assert all(point.model_error_mm is None for point in operating_points(model, None))


def test_finer_settings_cost_more_and_err_less(points: list[OperatingPoint], model: LatentModel) -> None:
    for method in ("euler", "midpoint", "rk4", "bosh3", "dopri5"):
        settings = [quality for quality in ladder(1.0 / 120.0) if quality.method == method]
        coarse, fine = (measure(model, points[1], setting, repeats=1) for setting in (settings[0], settings[-1]))
        assert coarse["evaluations"] < fine["evaluations"]
        assert fine["solver_error_mm"] < 0.5 * coarse["solver_error_mm"]
        assert coarse["model_error_mm"] == fine["model_error_mm"] == points[1].model_error_mm
        assert ("step" in coarse) != ("tolerance" in coarse)


def test_double_precision_reaches_errors_that_single_precision_cannot(
    points: list[OperatingPoint], model: LatentModel
) -> None:
    single, double = (
        measure(model, points[0], SolverSettings("dopri5", tolerance=1e-9, dtype=dtype), repeats=1)["solver_error_mm"]
        for dtype in ("float32", "float64")
    )
    assert double < 0.1 * single
