"""Work-precision: the cost and the error of each solver setting.

Two errors are kept apart. The solver error compares a setting with a converged integration of the same field; the model
error compares the converged integration with the truth. Both are root mean squares over the points and coordinates of
the body and over the frames of the window.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from odeform.benchmark.probes import nearest_sequences, random_parameters
from odeform.benchmark.timing import milliseconds
from odeform.dataset.index import Dataset
from odeform.evaluation.metrics import evaluate
from odeform.models.frontier import EXACT
from odeform.models.model import Model
from odeform.motion.reduced_space import motion_rmse
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats

__all__ = ["OperatingPoint", "ladder", "measure", "operating_points", "work_precision"]

TIGHTER = 1e-2  # factor on the tolerance of EXACT, to verify that it has converged
SEQUENCES = 8  # of the test split, nearest to an operating point, for the model error there
REPEATS = 15
DRAWS = 64


@dataclass(frozen=True)
class OperatingPoint:
    """A parameter set at which settings are compared; `exact` (T, 6 + K) is the converged reduced motion there."""

    name: str
    parameters: Parameters
    exact: Floats
    unsure_mm: float
    """How much the converged motion changes when its tolerance is tightened once more."""
    model_error_mm: float | None
    """Pooled over the test sequences nearest to this point, `sequences`; None without a data set."""
    sequences: tuple[str, ...]


def _reduced(model: Model, parameters: Parameters, quality: SolverSettings) -> tuple[Floats, int]:
    """(T, 6 + K) at the frames of the window, NaN where the integration failed, and the number of evaluations."""
    times = model.schema.window.times
    evaluated = model.evaluate_basis(model.rest, 0.0)
    solved = model.integrate(model.schema.vector(parameters), evaluated, quality, float(times[-1]))
    return solved.reduced(times) + (0.0 if np.isinf(solved.last_good) else np.nan), solved.stats.evaluations


def operating_points(model: Model, dataset: Dataset | None) -> list[OperatingPoint]:
    """The default parameters, and the corner of the trained box that takes the most evaluations.

    In a scene with objects, which has no corners, the latter is one of `DRAWS` random parameter sets.
    """

    def solved_at(name: str, parameters: Parameters) -> OperatingPoint:
        exact, _ = _reduced(model, parameters, EXACT)
        tighter, _ = _reduced(model, parameters, replace(EXACT, tolerance=TIGHTER * (EXACT.tolerance or 0.0)))
        unsure, error, names = 1e3 * motion_rmse(tighter, exact, model.space.gyration_radius), None, ()
        if dataset is not None:
            near = nearest_sequences(dataset, parameters, SEQUENCES)
            error = evaluate(model, near, "test", quality=EXACT)["rmse_pooled_mm"]
            names = tuple(entry.name for entry in near.entries)
        return OperatingPoint(name, parameters, exact, unsure, error, names)

    probe = SolverSettings("dopri5", tolerance=1e-5)
    edges = random_parameters(model, DRAWS) if model.schema.objects else model.schema.corners()
    hardest = max(edges, key=lambda parameters: _reduced(model, parameters, probe)[1])
    return [solved_at("default", model.schema.complete(None)), solved_at("corner", hardest)]


def ladder(frame: float) -> list[SolverSettings]:
    """Settings of each method from coarse to fine; `frame` is the time between frames in seconds."""
    steps = {"euler": (1.0, 1 / 4, 1 / 16), "midpoint": (1.0, 1 / 2, 1 / 8), "rk4": (4.0, 2.0, 1.0, 1 / 2, 1 / 4)}
    tolerances = {"bosh3": (1e-2, 1e-3, 1e-4, 1e-5), "dopri5": (1e-2, 1e-3, 1e-4, 1e-5, 1e-7)}
    fixed = [SolverSettings(method, step=frame * part) for method, parts in steps.items() for part in parts]
    return fixed + [SolverSettings(method, tolerance=t) for method, values in tolerances.items() for t in values]


def measure(model: Model, point: OperatingPoint, quality: SolverSettings, repeats: int = REPEATS) -> dict[str, Any]:
    """One row: a parameter change on a known shape, timed from encoding to the solved trajectory."""
    reduced, evaluations = _reduced(model, point.parameters, quality)
    error = 1e3 * motion_rmse(reduced[1:], point.exact[1:], model.space.gyration_radius)
    theta, evaluated = model.schema.vector(point.parameters), model.evaluate_basis(model.rest, 0.0)
    samples = milliseconds(
        lambda _: model.integrate(theta, evaluated, quality, model.schema.window.stop), repeats, warm=1
    )
    setting = {"step": quality.step} if quality.step is not None else {"tolerance": quality.tolerance}
    return {
        "at": point.name,
        "solver": quality.method,
        **setting,
        "dtype": quality.dtype,
        "evaluations": evaluations,
        "ms_p50": float(np.percentile(samples, 50)),
        "ms_p95": float(np.percentile(samples, 95)),
        "solver_error_mm": error if np.isfinite(error) else None,
        "model_error_mm": point.model_error_mm,
    }


def work_precision(model: Model, points: list[OperatingPoint]) -> list[dict[str, Any]]:
    """Measures every setting of the ladder, in both precisions, at every operating point."""
    settings = ladder(1.0 / model.schema.window.rate)
    return [
        measure(model, point, replace(quality, dtype=dtype))
        for point in points
        for dtype in ("float32", "float64")
        for quality in settings
    ]
