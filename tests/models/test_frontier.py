import math

import pytest

from odeform.errors import InputError
from odeform.models.frontier import FrontierPoint, cheapest_within_error, finest_within_budget, non_dominated
from odeform.solver.integrate import SolverSettings


def point(evaluations: float, error: float) -> FrontierPoint:
    return FrontierPoint(SolverSettings("rk4", step=1.0 / evaluations), evaluations, error, 0.1 * error)


COARSE, MIDDLE, FINE = point(10.0, 5.0), point(40.0, 0.5), point(200.0, 0.01)
FRONTIER = (COARSE, MIDDLE, FINE)


def test_only_what_nothing_beats_is_kept() -> None:
    beaten = [point(41.0, 0.5), point(40.0, 0.6), point(300.0, 0.02), point(5.0, math.nan), point(6.0, math.inf)]
    assert non_dominated([*beaten, FINE, COARSE, MIDDLE]) == FRONTIER


@pytest.mark.parametrize(("error", "chosen"), [(9.0, COARSE), (0.5, MIDDLE), (0.49, FINE), (1e-6, FINE)])
def test_an_error_picks_the_cheapest(error: float, chosen: FrontierPoint) -> None:
    assert cheapest_within_error(FRONTIER, error) is chosen


@pytest.mark.parametrize(("budget", "chosen"), [(0.01, COARSE), (0.39, COARSE), (0.4, MIDDLE), (99.0, FINE)])
def test_a_budget_picks_the_finest(budget: float, chosen: FrontierPoint) -> None:
    assert finest_within_budget(FRONTIER, budget, ms_per_evaluation=0.01) is chosen


@pytest.mark.parametrize(
    "quality", [SolverSettings("rk4", step=0.01), SolverSettings("dopri5", tolerance=1e-3, dtype="float64")], ids=str
)
def test_points_survive_json(quality: SolverSettings) -> None:
    one = FrontierPoint(quality, 12.5, 0.25, 0.05)
    assert FrontierPoint.from_json(one.to_json()) == one


def test_without_a_frontier_nothing_is_chosen() -> None:
    with pytest.raises(InputError, match="frontier"):
        cheapest_within_error((), 1.0)
