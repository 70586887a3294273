"""Which integration is good enough: the qualities of a checkpoint, from its own errors on the validation split."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from odeform.model.data import TrainingData
from odeform.model.odeform import ODeform
from odeform.model.reduced import POSE
from odeform.solver.integrate import Quality
from odeform.types import Floats

__all__ = ["choose_qualities"]

SHARES = {"draft": 1.0, "balanced": 0.1}
"""Solver error that a quality may add, as a share of the model's own. A tenth adds half a per cent to the total."""
REFERENCE = {"method": "dopri5", "tolerance": 1e-7}
TRUTH = Quality("dopri5", tolerance=1e-10, dtype="float64")


def _candidates(step: float) -> list[dict[str, object]]:
    tolerances = [10.0**-power for power in np.arange(2.0, 7.25, 0.5)]
    adaptive = [{"method": m, "tolerance": float(f"{t:.1g}")} for m in ("bosh3", "dopri5") for t in tolerances]
    return [*adaptive, *({"method": "rk4", "step": step * factor} for factor in (2.0, 1.0, 0.5, 0.25))]


def choose_qualities(model: ODeform, data: TrainingData, shares: Mapping[str, float] = SHARES) -> dict[str, Any]:
    """Settings of each quality: those of the fewest evaluations whose error keeps to its share of the model's.

    Over the validation sequences; the solver's error is that against tolerance 1e-10 in double precision, the model's
    that of this reference against the data.
    """
    placed = model.place(model.rest, 0.0)
    scale = np.full(data.reduced["val"].shape[-1], 1e3)
    scale[3:POSE] *= data.space.arm * np.sqrt(2.0 / 3.0)

    def motions(quality: Quality) -> tuple[Floats, float]:
        """(S, T, y), not a number where the integration failed, and the mean count of evaluations."""
        stop = float(data.times[-1])
        solved = [model.integrate(theta, placed, quality, stop) for theta in data.theta["val"]]
        reduced = [s.reduced(data.times) + (0.0 if s.stats.status == "ok" else np.nan) for s in solved]
        return np.stack(reduced), float(np.mean([s.stats.evaluations for s in solved]))

    def rmse(a: Floats, b: Floats) -> float:
        return float(np.sqrt((((a - b) * scale)[:, 1:] ** 2).sum(axis=-1).mean() / 3.0))

    truth, _ = motions(TRUTH)
    allowed = rmse(truth, data.reduced["val"])
    costs = []
    for setting in _candidates(float(data.times[1] - data.times[0])):
        reduced, evaluations = motions(Quality(**setting))  # pyright: ignore[reportArgumentType]
        costs.append((evaluations, rmse(reduced, truth), setting))
    costs.sort(key=lambda cost: cost[0])
    chosen = {
        name: next((setting for _, error, setting in costs if error <= share * allowed), REFERENCE)
        for name, share in shares.items()
    }
    return {**chosen, "reference": REFERENCE}
