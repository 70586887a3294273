"""The trade of work against accuracy: settings of the solver that no other beats in both."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from odeform.errors import InputError
from odeform.solver.integrate import SolverSettings

__all__ = ["EXACT", "FrontierPoint", "cheapest_within_error", "finest_within_budget", "non_dominated"]

EXACT = SolverSettings("dopri5", tolerance=1e-10, dtype="float64")
"""What solver errors are measured against."""
MEASURED = ("evaluations", "solver_error_mm", "deformation_error_mm")


@dataclass(frozen=True)
class FrontierPoint:
    """A way to integrate, the field evaluations it takes on average, and its solver error in RMS mm.

    `deformation_error_mm` is that of the deformation alone, which is small beside the way that a body goes.
    """

    quality: SolverSettings
    evaluations: float
    solver_error_mm: float
    deformation_error_mm: float

    def to_json(self) -> dict[str, Any]:
        return {**self.quality.to_json(), **{name: getattr(self, name) for name in MEASURED}}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> "FrontierPoint":
        setting = dict(data)
        measured = [float(setting.pop(name)) for name in MEASURED]
        return cls(SolverSettings(**setting), *measured)


def non_dominated(points: Iterable[FrontierPoint]) -> tuple[FrontierPoint, ...]:
    """From cheap and coarse to dear and fine; a failed setting, whose error is not a number, is on no frontier."""
    kept: list[FrontierPoint] = []
    for point in sorted(points, key=lambda p: (p.evaluations, p.solver_error_mm)):
        if point.solver_error_mm < (kept[-1].solver_error_mm if kept else float("inf")):
            kept.append(point)
    return tuple(kept)


def cheapest_within_error(
    frontier: Sequence[FrontierPoint], error_mm: float, deformation_mm: float = float("inf")
) -> FrontierPoint:
    """The cheapest point whose solver errors, of all and of the deformation, are at most these; else the finest."""
    return next(
        (p for p in _known(frontier) if p.solver_error_mm <= error_mm and p.deformation_error_mm <= deformation_mm),
        frontier[-1],
    )


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
