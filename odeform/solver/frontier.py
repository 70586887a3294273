"""The trade of work against accuracy: settings of the solver that no other beats in both."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from odeform.errors import InputError
from odeform.solver.integrate import Quality

__all__ = ["FrontierPoint", "cheapest_within_error", "finest_within_budget", "non_dominated"]


@dataclass(frozen=True)
class FrontierPoint:
    """A way to integrate, the field evaluations it takes on average, and its solver error in RMS mm."""

    quality: Quality
    evaluations: float
    solver_error_mm: float

    def to_json(self) -> dict[str, Any]:
        return {**self.quality.to_json(), "evaluations": self.evaluations, "solver_error_mm": self.solver_error_mm}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> "FrontierPoint":
        setting = dict(data)
        evaluations, error = setting.pop("evaluations"), setting.pop("solver_error_mm")
        return cls(Quality(**setting), float(evaluations), float(error))


def non_dominated(points: Iterable[FrontierPoint]) -> tuple[FrontierPoint, ...]:
    """From cheap and coarse to dear and fine; a failed setting, whose error is not a number, is on no frontier."""
    kept: list[FrontierPoint] = []
    for point in sorted(points, key=lambda p: (p.evaluations, p.solver_error_mm)):
        if point.solver_error_mm < (kept[-1].solver_error_mm if kept else float("inf")):
            kept.append(point)
    return tuple(kept)


def cheapest_within_error(frontier: Sequence[FrontierPoint], error_mm: float) -> FrontierPoint:
    """The cheapest point whose solver error is at most `error_mm`; the finest where none is."""
    return next((point for point in _known(frontier) if point.solver_error_mm <= error_mm), frontier[-1])


def finest_within_budget(
    frontier: Sequence[FrontierPoint], budget_ms: float, ms_per_evaluation: float
) -> FrontierPoint:
    """The finest point that takes at most `budget_ms`, at the time that an evaluation takes here; else the cheapest."""
    affordable = [p for p in _known(frontier) if p.evaluations * ms_per_evaluation <= budget_ms]
    return affordable[-1] if affordable else frontier[0]


def _known(frontier: Sequence[FrontierPoint]) -> Sequence[FrontierPoint]:
    if not frontier:
        raise InputError("frontier: expected at least one point; this checkpoint brings none")
    return frontier
