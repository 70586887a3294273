from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.dataset.training_data import prepare
from odeform.models.base import Predictor
from odeform.models.frontier import FrontierPoint
from odeform.models.latent.model import LatentModel
from odeform.models.training import qualities
from odeform.models.training.qualities import USELESS, Validation, choose_qualities, measure_frontier
from odeform.solver.integrate import SolverSettings

Measured = tuple[tuple[FrontierPoint, ...], tuple[float, float]]


@pytest.fixture(scope="module")
def measured(dataset: Dataset, predictors: dict[str, Predictor]) -> Measured:
    model = cast(LatentModel, predictors["odeform"])
    return measure_frontier(model, Validation.of(prepare(dataset, modes=model.space.basis.modes)))


def test_a_frontier_trades_work_for_accuracy(measured: Measured, predictors: dict[str, Predictor]) -> None:
    frontier, (error_mm, deformation_mm) = measured
    work, errors = np.array([(p.evaluations, p.solver_error_mm) for p in frontier]).T
    assert (np.diff(work) > 0.0).all()
    assert (np.diff(errors) < 0.0).all()
    assert errors[-1] < 1e-2 * error_mm
    assert frontier[-1].deformation_error_mm < 1e-2 * deformation_mm
    motion = predictors["odeform"].solve(quality=frontier[0].quality)
    assert motion.stats.evaluations == pytest.approx(work[0], rel=0.3)


def test_what_is_far_worse_than_the_model_is_left_out(measured: Measured) -> None:
    frontier, (own, _) = measured
    assert all(point.solver_error_mm <= USELESS * own for point in frontier)


def test_qualities_are_points_of_it(measured: Measured) -> None:
    frontier, errors = measured
    known = {point.quality: point for point in frontier}
    for share in (1.0, 0.01):
        error, deformation = (share * e for e in errors)
        points = {
            n: known[SolverSettings(**setting)]
            for n, setting in choose_qualities(frontier, (error, deformation)).items()
        }
        assert points["draft"].solver_error_mm <= error
        assert points["draft"].deformation_error_mm <= deformation
        assert points["balanced"].solver_error_mm <= max(0.1 * error, frontier[-1].solver_error_mm)
        assert points["balanced"].deformation_error_mm <= max(0.3 * deformation, frontier[-1].deformation_error_mm)
        assert points["draft"].evaluations <= points["balanced"].evaluations <= points["reference"].evaluations
        assert points["reference"] is frontier[-1]


@pytest.mark.parametrize("errors", [(1e-12, 1.0), (1.0, 1e-12)])
def test_nothing_is_exact_enough(measured: Measured, errors: tuple[float, float]) -> None:
    frontier, _ = measured
    assert SolverSettings(**choose_qualities(frontier, errors)["balanced"]) == frontier[-1].quality


def test_a_checkpoint_brings_its_frontier(predictors: dict[str, Predictor]) -> None:
    model = predictors["odeform"]
    assert list(model.qualities) == ["draft", "balanced", "reference"]
    assert set(model.qualities.values()) <= {point.quality for point in model.frontier}
    assert predictors["pod-rbf"].frontier == ()


def test_the_model_is_not_blamed_for_what_a_spline_filled_in(
    dataset: Dataset, predictors: dict[str, Predictor], monkeypatch: pytest.MonkeyPatch
) -> None:
    model = cast(LatentModel, predictors["odeform"])
    monkeypatch.setattr(qualities, "_candidates", lambda _: [SolverSettings("rk4", step=0.01)])
    known = Validation.of(prepare(dataset, model.space.basis.modes, FrameSubsampling(every=6, stagger=True)))
    wrong = replace(known, reduced=known.reduced + 9.0 * ~known.observed[..., None])
    assert measure_frontier(model, wrong) == measure_frontier(model, known)


def test_the_reference_is_the_finest_even_where_nothing_moves_yet() -> None:
    """After a few steps of training the cheapest settings may be exact, and are then all of the frontier."""
    coarse, fine = SolverSettings("rk4", step=0.1), SolverSettings("rk4", step=0.01)
    still = (FrontierPoint(coarse, 4.0, 0.0, 0.0),)
    chosen = choose_qualities(still, (10.0, 1.0), finest=fine)
    assert SolverSettings(**chosen["draft"]) == coarse
    assert SolverSettings(**chosen["reference"]) == fine


def test_the_reference_is_never_coarser_than_what_was_measured_as_finer() -> None:
    fine, finer = SolverSettings("rk4", step=0.01), SolverSettings("dopri5", tolerance=1e-6)
    frontier = (FrontierPoint(fine, 40.0, 1e-2, 1e-3), FrontierPoint(finer, 60.0, 1e-4, 1e-5))
    assert SolverSettings(**choose_qualities(frontier, (1e-2, 1e-3), finest=fine)["reference"]) == finer
