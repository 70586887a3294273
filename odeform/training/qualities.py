"""Which integration is good enough: the qualities of a checkpoint, from its own errors on the validation split."""

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
TRUTH = Quality("dopri5", tolerance=1e-10)
SEQUENCES = 16


def _candidates(step: float) -> list[dict[str, object]]:
    tolerances = [10.0**-power for power in np.arange(2.0, 7.25, 0.5)]
    adaptive = [{"method": m, "tolerance": float(f"{t:.1g}")} for m in ("bosh3", "dopri5") for t in tolerances]
    return [*adaptive, *({"method": "rk4", "step": step * factor} for factor in (2.0, 1.0, 0.5, 0.25))]


def choose_qualities(model: ODeform, data: TrainingData, error_mm: float) -> dict[str, dict[str, object]]:
    """Settings of each quality: those of the fewest evaluations that keep to its share of the model's RMSE `error_mm`.

    The solver's error is that against a reference of tolerance 1e-10 in double precision, over validation parameters.
    """
    thetas = data.theta["val"][:SEQUENCES]
    placed = model.place(model.rest, 0.0)

    def motions(quality: Quality, dtype: type) -> tuple[Floats, float]:
        solved = [model.integrate(theta, placed, quality, float(data.times[-1]), dtype) for theta in thetas]
        return np.stack([s.reduced(data.times) for s in solved]), float(np.mean([s.stats.evaluations for s in solved]))

    truth, _ = motions(TRUTH, np.float64)
    scale = np.full(truth.shape[-1], 1e3)
    scale[3:POSE] *= data.space.arm * np.sqrt(2.0 / 3.0)
    costs = []
    for setting in _candidates(float(data.times[1] - data.times[0])):
        reduced, evaluations = motions(Quality(**setting), np.float32)  # pyright: ignore[reportArgumentType]
        error = float(np.sqrt((((reduced - truth) * scale)[:, 1:] ** 2).sum(axis=-1).mean() / 3.0))
        costs.append((evaluations, error if np.isfinite(error) else np.inf, setting))
    costs.sort(key=lambda cost: cost[0])
    chosen = {
        name: next((setting for _, error, setting in costs if error <= share * error_mm), REFERENCE)
        for name, share in SHARES.items()
    }
    return {**chosen, "reference": REFERENCE}
