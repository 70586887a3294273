"""Work-precision: what each way to integrate costs, and how far it is off.

Two errors, never mixed. The solver's is that of a setting against a converged integration of the same field; the
model's that of the converged integration against the truth. Both are root mean squares over the body's points and
coordinates and over the frames of the window.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from odeform.benchmark.probes import nearest_sequences
from odeform.benchmark.timing import milliseconds
from odeform.dataset.index import Dataset
from odeform.evaluation.metrics import evaluate
from odeform.models.frontier import EXACT
from odeform.models.odeform.model import ODeform
from odeform.motion.reduced_space import motion_rmse
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats

__all__ = ["Place", "find_places", "ladder", "measure", "work_precision"]

TIGHTER = 1e-2  # times the tolerance of EXACT, which verifies it
SEQUENCES = 8  # of the test split, nearest to a place, for the model's error there
REPEATS = 15


@dataclass(frozen=True)
class Place:
    """Where in the box of parameters settings are compared; `exact` (T, 6 + K) is the converged motion there."""

    name: str
    parameters: dict[str, float]
    exact: Floats
    unsure_mm: float
    """How far the converged motion moves when its tolerance is tightened once more."""
    model_error_mm: float | None
    """Pooled over `sequences` of the test split, those nearest to this place; None without truth."""
    sequences: tuple[str, ...]


def _reduced(model: ODeform, parameters: Mapping[str, float], quality: SolverSettings) -> tuple[Floats, int]:
    """(T, 6 + K) at the frames of the window, and the evaluations; not a number where the integration failed."""
    times = model.schema.window.times
    evaluated = model.evaluate_basis(model.rest, 0.0)
    solved = model.integrate(model.schema.vector(parameters), evaluated, quality, float(times[-1]))
    return solved.reduced(times) + (0.0 if np.isinf(solved.last_good) else np.nan), solved.stats.evaluations


def find_places(model: ODeform, dataset: Dataset | None) -> list[Place]:
    """The default parameters, and the corner of the trained box whose field asks for the most evaluations."""

    def place(name: str, parameters: dict[str, float]) -> Place:
        exact, _ = _reduced(model, parameters, EXACT)
        tighter, _ = _reduced(model, parameters, replace(EXACT, tolerance=TIGHTER * (EXACT.tolerance or 0.0)))
        unsure, error, names = 1e3 * motion_rmse(tighter, exact, model.space.gyration_radius), None, ()
        if dataset is not None:
            near = nearest_sequences(dataset, parameters, SEQUENCES)
            error = evaluate(model, near, "test", quality=EXACT)["rmse_pooled_mm"]
            names = tuple(entry.name for entry in near.entries)
        return Place(name, parameters, exact, unsure, error, names)

    probe = SolverSettings("dopri5", tolerance=1e-5)
    hardest = max(model.schema.corners(), key=lambda parameters: _reduced(model, parameters, probe)[1])
    return [place("default", model.schema.complete(None)), place("corner", hardest)]


def ladder(frame: float) -> list[SolverSettings]:
    """Each method from coarse to fine; `frame` in seconds."""
    steps = {"euler": (1.0, 1 / 4, 1 / 16), "midpoint": (1.0, 1 / 2, 1 / 8), "rk4": (4.0, 2.0, 1.0, 1 / 2, 1 / 4)}
    tolerances = {"bosh3": (1e-2, 1e-3, 1e-4, 1e-5), "dopri5": (1e-2, 1e-3, 1e-4, 1e-5, 1e-7)}
    fixed = [SolverSettings(method, step=frame * share) for method, shares in steps.items() for share in shares]
    return fixed + [SolverSettings(method, tolerance=t) for method, values in tolerances.items() for t in values]


def measure(model: ODeform, place: Place, quality: SolverSettings, repeats: int = REPEATS) -> dict[str, Any]:
    """One row: a change of parameters at a known shape, from encoding to the solved trajectory."""
    reduced, evaluations = _reduced(model, place.parameters, quality)
    error = 1e3 * motion_rmse(reduced[1:], place.exact[1:], model.space.gyration_radius)
    theta, evaluated = model.schema.vector(place.parameters), model.evaluate_basis(model.rest, 0.0)
    samples = milliseconds(
        lambda _: model.integrate(theta, evaluated, quality, model.schema.window.stop), repeats, warm=1
    )
    setting = {"step": quality.step} if quality.step is not None else {"tolerance": quality.tolerance}
    return {
        "at": place.name,
        "solver": quality.method,
        **setting,
        "dtype": quality.dtype,
        "evaluations": evaluations,
        "ms_p50": float(np.percentile(samples, 50)),
        "ms_p95": float(np.percentile(samples, 95)),
        "solver_error_mm": error if np.isfinite(error) else None,
        "model_error_mm": place.model_error_mm,
    }


def work_precision(model: ODeform, places: list[Place]) -> list[dict[str, Any]]:
    """Every setting of the ladder, in both precisions, at every place."""
    settings = ladder(1.0 / model.schema.window.rate)
    return [
        measure(model, place, replace(quality, dtype=dtype))
        for place in places
        for dtype in ("float32", "float64")
        for quality in settings
    ]
