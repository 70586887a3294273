"""What integration costs and how far it is off: the frontier of a checkpoint, from its own validation split."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from odeform.model.data import TrainingData
from odeform.model.odeform import ODeform
from odeform.model.reduced import body_scale
from odeform.solver.frontier import FrontierPoint, cheapest_within_error, non_dominated
from odeform.solver.integrate import Quality
from odeform.types import Floats

__all__ = ["choose_qualities", "measure_frontier"]

SHARES = {"draft": 1.0, "balanced": 0.1}
"""Solver error that a quality may add, as a share of the model's own. A tenth adds half a per cent to the total."""
TRUTH = Quality("dopri5", tolerance=1e-10, dtype="float64")


def _candidates(step: float) -> list[Quality]:
    tolerances = [float(f"{10.0**-power:.1g}") for power in np.arange(2.0, 7.25, 0.5)]
    adaptive = [Quality(method, tolerance=t) for method in ("bosh3", "dopri5") for t in tolerances]
    fixed = [Quality("midpoint", step=step * factor) for factor in (2.0, 1.0, 0.5)]
    fixed += [Quality("rk4", step=step * factor) for factor in (4.0, 2.0, 1.0, 0.5, 0.25)]
    return [*adaptive, *fixed]


def measure_frontier(model: ODeform, data: TrainingData) -> tuple[tuple[FrontierPoint, ...], float]:
    """The settings worth choosing from, and the model's own error in mm, over the validation sequences.

    The solver's error is that against tolerance 1e-10 in double precision, the model's that of this reference against
    the data; both are root mean squares over the body's points and coordinates, and over time.
    """
    placed = model.place(model.rest, 0.0)
    scale = body_scale(data.space.arm, data.reduced["val"].shape[-1])

    def motions(quality: Quality) -> tuple[Floats, float]:
        """(S, T, y), not a number where the integration failed, and the mean count of evaluations."""
        stop = float(data.times[-1])
        solved = [model.integrate(theta, placed, quality, stop) for theta in data.theta["val"]]
        reduced = [s.reduced(data.times) + (0.0 if s.stats.status == "ok" else np.nan) for s in solved]
        return np.stack(reduced), float(np.mean([s.stats.evaluations for s in solved]))

    def rmse(a: Floats, b: Floats) -> float:
        return float(1e3 * np.sqrt((((a - b) * scale)[:, 1:] ** 2).sum(axis=-1).mean() / 3.0))

    truth, _ = motions(TRUTH)
    points = []
    for quality in _candidates(float(data.times[1] - data.times[0])):
        reduced, evaluations = motions(quality)
        points.append(FrontierPoint(quality, evaluations, rmse(reduced, truth)))
    return non_dominated(points), rmse(truth, data.reduced["val"])


def choose_qualities(
    frontier: Sequence[FrontierPoint], model_error_mm: float, shares: Mapping[str, float] = SHARES
) -> dict[str, Any]:
    """Settings of each quality: the cheapest whose error keeps to its share of the model's, and the finest of all."""
    chosen = {name: cheapest_within_error(frontier, share * model_error_mm) for name, share in shares.items()}
    return {name: point.quality.to_json() for name, point in {**chosen, "reference": frontier[-1]}.items()}
