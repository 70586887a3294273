"""Cost and error of the integration: the frontier of a checkpoint, measured on its own validation split."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.models.frontier import EXACT, FrontierPoint, cheapest_within_error, non_dominated
from odeform.models.model import Model
from odeform.models.reduced_model import ReducedModel
from odeform.models.registry import load_model
from odeform.motion.reduced_space import POSE, motion_rmse
from odeform.motion.trajectory import Trajectory
from odeform.solver.integrate import SolverSettings
from odeform.types import Bools, Floats, Times

__all__ = ["USELESS", "Validation", "choose_qualities", "measure_frontier", "with_qualities"]

FRACTIONS = {"draft": (1.0, 1.0), "balanced": (0.1, 0.3)}
"""Solver error that a quality may add, as a fraction of the model's own error: in total, and of the deformation alone.
A tenth adds half a per cent to the total error, three tenths add four per cent to that of the deformation."""

DIGITS = 9  # of errors in mm: what is less is round-off
USELESS = 10.0
"""Times the model's own error: settings with a larger error are never shown."""


@dataclass(frozen=True, eq=False)
class Validation:
    """Reduced motions of the validation split."""

    theta: Floats
    """(S, P) inputs of the model."""
    times: Times
    """(T,) s of the frames, the same for all."""
    reduced: Floats
    """(S, T, y) metres and radians."""
    observed: Bools
    """(S, T): false where a spline filled a frame in, which is no truth."""

    @classmethod
    def of(cls, data: TrainingData) -> "Validation":
        """Takes the validation motions from the data of a reduced model."""
        return cls(data.theta["val"], data.times, data.reduced["val"], data.observed["val"])


def _candidates(step: float) -> list[SolverSettings]:
    """Explicit methods, for frames that are `step` seconds apart."""
    tolerances = [float(f"{digit}e-{power}") for power in range(2, 8) for digit in (6, 4, 3, 2, 1)]
    adaptive = [SolverSettings(method, tolerance=t) for method in ("bosh3", "dopri5") for t in tolerances]
    fixed = [SolverSettings("midpoint", step=step * factor) for factor in (2.0, 1.0, 0.5)]
    fixed += [SolverSettings("rk4", step=step * factor) for factor in (4.0, 2.0, 1.0, 0.5, 0.25)]
    return [*adaptive, *fixed]


def measure_frontier(
    model: ReducedModel,
    known: Validation,
    reference: SolverSettings = EXACT,
    candidates: Sequence[SolverSettings] | None = None,
) -> tuple[tuple[FrontierPoint, ...], tuple[float, float]]:
    """The non-dominated settings that are of use, and the model's own errors in mm, over the validation sequences.

    Tried are the `candidates`, by default explicit methods.

    The solver's error is measured against the `reference`, the model's is that of the reference against the data; both
    in total and of the deformation alone, as root mean squares over points, coordinates and time. Of an ODE that goes
    on beyond the window, the solver's error is that of its own motion: a correction may hide it, but it ends there.
    """
    evaluated, stop = model.evaluate_basis(model.rest, 0.0), float(known.times[-1])
    alone = model.integrate if isinstance(model, Model) and model.continues_itself else model.trajectory

    def motions(quality: SolverSettings, solve: Callable[..., Trajectory] = alone) -> tuple[Floats, float]:
        """(S, T, y), NaN where the integration failed, and the mean number of evaluations."""
        solved = [solve(theta, evaluated, quality, stop) for theta in known.theta]
        reduced = [s.reduced(known.times) + (0.0 if s.stats.status == "ok" else np.nan) for s in solved]
        return np.stack(reduced), float(np.mean([s.stats.evaluations for s in solved]))

    frames = known.observed & (known.times > 0.0)  # at rest there is no error

    def errors_mm(motion: Floats, truth: Floats) -> tuple[float, float]:
        motion, truth = motion[frames], truth[frames]
        stiff = np.concatenate([truth[..., :POSE], motion[..., POSE:]], axis=-1)
        of_all, of_deformation = (motion_rmse(one, truth, model.space.gyration_radius) for one in (motion, stiff))
        return round(1e3 * of_all, DIGITS), round(1e3 * of_deformation, DIGITS)

    truth, _ = motions(reference)
    points = []
    for quality in _candidates(float(known.times[1] - known.times[0])) if candidates is None else candidates:
        reduced, evaluations = motions(quality)
        points.append(FrontierPoint(quality, evaluations, *errors_mm(reduced, truth)))
    whole = truth if alone == model.trajectory else motions(reference, model.trajectory)[0]
    model_errors = errors_mm(whole, known.reduced)
    useful = [point for point in points if point.solver_error_mm <= USELESS * model_errors[0]]
    return non_dominated(useful or points), model_errors


def choose_qualities(
    frontier: Sequence[FrontierPoint],
    model_errors_mm: tuple[float, float],
    fractions: Mapping[str, tuple[float, float]] = FRACTIONS,
    finest: SolverSettings | None = None,
) -> dict[str, Any]:
    """Settings of each quality: the cheapest within its fractions of the model's errors; `reference` is the finest
    point.

    Where no settings have an error, the cheapest is the only point: `reference` is then `finest`, if it is given. So it
    is where nothing moves yet after a few steps of training, and where a regression alone makes the motion.
    """
    chosen = {
        name: cheapest_within_error(frontier, *np.multiply(of, model_errors_mm)) for name, of in fractions.items()
    }
    last = frontier[-1]
    reference = finest if finest is not None and last.solver_error_mm == 0.0 else last.quality
    return {**{name: point.quality.to_json() for name, point in chosen.items()}, "reference": reference.to_json()}


def with_qualities(
    checkpoint: Checkpoint,
    known: Validation,
    reference: SolverSettings = EXACT,
    candidates: Sequence[SolverSettings] | None = None,
    fractions: Mapping[str, tuple[float, float]] = FRACTIONS,
) -> Checkpoint:
    """The checkpoint of a trained model with its frontier, as `measure_frontier` finds it, and the qualities that are
    chosen on it by `choose_qualities`; the last of the candidates is the finest."""
    model = load_model(checkpoint)
    assert isinstance(model, ReducedModel)
    tried = _candidates(float(known.times[1] - known.times[0])) if candidates is None else candidates
    frontier, errors_mm = measure_frontier(model, known, reference, tried)
    qualities = choose_qualities(frontier, errors_mm, fractions, tried[-1])
    settings = {"qualities": qualities, "frontier": [point.to_json() for point in frontier]}
    return replace(checkpoint, config={**checkpoint.config, **settings})
