"""The trade-off between work and accuracy: solver settings that no other beats in both."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from odeform.errors import InputError
from odeform.solver.integrate import SolverSettings

__all__ = ["EXACT", "FrontierPoint", "cheapest_within_error", "finest_within_budget", "non_dominated"]

EXACT = SolverSettings("dopri5", tolerance=1e-10, dtype="float64")
"""The reference for solver errors."""
MEASURED = ("evaluations", "solver_error_mm", "deformation_error_mm")


@dataclass(frozen=True)
class FrontierPoint:
    """Solver settings, the mean number of field evaluations, and the solver error in RMS mm.

    `deformation_error_mm` is the error of the deformation alone, which is small beside the motion of the whole body.
    """

    quality: SolverSettings
    evaluations: float
    solver_error_mm: float
    deformation_error_mm: float

    def to_json(self) -> dict[str, Any]:
        """Plain values, which `from_json` reads."""
        return {**self.quality.to_json(), **{name: getattr(self, name) for name in MEASURED}}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> "FrontierPoint":
        """Inverts `to_json`."""
        setting = dict(data)
        measured = [float(setting.pop(name)) for name in MEASURED]
        return cls(SolverSettings(**setting), *measured)


def non_dominated(points: Iterable[FrontierPoint]) -> tuple[FrontierPoint, ...]:
    """The points that no other beats in work and error, from cheap to fine; without failed settings (NaN)."""
    kept: list[FrontierPoint] = []
    for point in sorted(points, key=lambda p: (p.evaluations, p.solver_error_mm)):
        if point.solver_error_mm < (kept[-1].solver_error_mm if kept else float("inf")):
            kept.append(point)
    return tuple(kept)


def cheapest_within_error(
    frontier: Sequence[FrontierPoint], error_mm: float, deformation_mm: float = float("inf")
) -> FrontierPoint:
    """The cheapest point whose solver errors, total and of the deformation, are at most these; else the finest.

    `InputError` for an empty frontier."""
    return next(
        (p for p in _nonempty(frontier) if p.solver_error_mm <= error_mm and p.deformation_error_mm <= deformation_mm),
        frontier[-1],
    )


def finest_within_budget(
    frontier: Sequence[FrontierPoint], budget_ms: float, ms_per_evaluation: float
) -> FrontierPoint:
    """The finest point that takes at most `budget_ms`, given the time of an evaluation; else the cheapest.

    `InputError` for an empty frontier."""
    affordable = [p for p in _nonempty(frontier) if p.evaluations * ms_per_evaluation <= budget_ms]
    return affordable[-1] if affordable else frontier[0]


def _nonempty(frontier: Sequence[FrontierPoint]) -> Sequence[FrontierPoint]:
    if not frontier:
        raise InputError("frontier: expected at least one point, but this checkpoint has none")
    return frontier
