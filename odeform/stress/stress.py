"""Numerical stability at extreme inputs, as checks with a figure and a bound: `odeform stress`."""

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.latent.model import LatentModel
from odeform.models.model import Model
from odeform.models.per_object import PerObject
from odeform.models.registry import load, load_reduced
from odeform.models.rolling.model import RollingModel
from odeform.motion.base import Motion
from odeform.parallel import parallel_map
from odeform.schema import Window
from odeform.stress.cases import Case, extreme_cases, methods_of, shapes, subsampled
from odeform.stress.check import Check, Checks
from odeform.stress.consistency import check_consistency
from odeform.stress.convergence import check_orders, check_refining
from odeform.stress.objects import stress_objects
from odeform.stress.physics import check_physics
from odeform.stress.shown import DRAWS, check_shown
from odeform.stress.solvers import check_calibration, check_field, check_sensitivities
from odeform.types import Floats, Geometry, Times

__all__ = ["Outcome", "report", "run_case", "stress"]

CASES = 20_000
MOMENTS = (0.0, 0.05, 0.3, 1.0, 1.5, 3.0, 10.0)  # trained windows
PATIENCE = 10.0  # s
BATCH = 64  # cases that a process takes at a time


@dataclass(frozen=True)
class Outcome:
    """The outcome of a case: a status, and figures of the motion at `MOMENTS`.

    `moved` and `deformed` are (T,) m: the largest distance of a point from rest, and the RMS deformation.
    """

    status: str
    seconds: float
    non_finite: int = 0
    """Number of frames with a non-finite coordinate."""
    start_error: float = 0.0
    """Largest difference between the first frame and the rest points, in metres."""
    moved: tuple[float, ...] = ()
    deformed: tuple[float, ...] = ()


def run_case(predictor: Predictor, case: Case, geometries: Mapping[str, Geometry]) -> Outcome:
    """Solve one case and evaluate it up to ten windows. Rejected inputs and exceptions are outcomes, too."""
    begin = time.perf_counter()
    try:
        return _evaluated(predictor, case, geometries[case.shape], begin)
    except InputError:
        return Outcome("refused", time.perf_counter() - begin)
    except Exception as error:
        return Outcome(f"fault: {type(error).__name__}", time.perf_counter() - begin)


def _evaluated(predictor: Predictor, case: Case, geometry: Geometry, begin: float) -> Outcome:
    schema = predictor.schema
    parameters = dict(zip(schema.names, case.values, strict=True))
    times = schema.window.stop * np.array(MOMENTS)
    motion = predictor.solve(geometry, parameters, case.quality or "balanced", until=times[-1])
    frames, rest = motion.vertices(times), np.asarray(geometry.points, dtype=np.float32)
    moved = np.sqrt(((frames - rest) ** 2).sum(axis=2).max(axis=1))
    return Outcome(
        status=_status(motion, times),
        seconds=time.perf_counter() - begin,
        non_finite=int((~np.isfinite(frames).all(axis=(1, 2))).sum()),
        start_error=float(np.abs(frames[0] - rest).max()),
        moved=tuple(moved.tolist()),
        deformed=tuple(motion.deformation_rms(times).tolist()),
    )


def _status(motion: Motion, times: Times) -> str:
    """Joins the solver's status and why a motion is clamped at any of the (T,) `times` in seconds."""
    clamped = next((stop.reason for stop in map(motion.stop_at, times.tolist()) if stop is not None), "")
    return (
        motion.stats.status
        + (f", stopped: {clamped}" if clamped else "")
        + (", outside the trained box" if motion.outside else "")
    )


def stress(checkpoint: str, count: int = CASES, seed: int = 0, draws: int = DRAWS) -> dict[str, Any]:
    """Runs `count` distinct cases, `draws` motions inside the trained box and all checks, as JSON.

    Of pushed objects, `draws` pushes until they rest.

    The seed fixes everything but wall times.
    """
    if isinstance(load(checkpoint), PerObject):
        return stress_objects(checkpoint, draws, seed)
    predictor = load_reduced(checkpoint)
    schema = predictor.schema
    cases = extreme_cases(schema, methods_of(predictor), count, seed)
    outcomes = parallel_map("stress", partial(_run_from, checkpoint), cases, batch_size=BATCH)
    checks = _overall(predictor, cases, outcomes)
    checks |= check_consistency(predictor, seed) | check_physics(predictor, seed)
    watched, inside = check_shown(checkpoint, draws, seed)
    checks |= watched
    if isinstance(predictor, LatentModel):  # others have contacts, at whose begin no method keeps its order
        checks |= check_orders(predictor, seed) | check_sensitivities(predictor, seed)
    if isinstance(predictor, Model):
        checks |= check_field(predictor, seed) | check_calibration(predictor, seed)
        if schema.scene in bundled_datasets():
            checks |= check_refining(predictor, open_dataset(schema.scene))
    return {
        "cases": len(cases),
        "non_finite_shown": sum(outcome.non_finite for outcome in outcomes),
        "by_status": dict(Counter(outcome.status for outcome in outcomes).most_common()),
        "inside": inside,
        "checks": {name: check.to_json() for name, check in checks.items()},
    }


def _run_from(checkpoint: str, case: Case) -> Outcome:
    predictor, geometries = _opened(checkpoint)
    return run_case(predictor, case, geometries)


@cache
def _opened(checkpoint: str) -> tuple[Predictor, dict[str, Geometry]]:
    """Opened once in each process."""
    predictor = load_reduced(checkpoint)
    return predictor, shapes(predictor.rest)


def _overall(predictor: Predictor, cases: list[Case], outcomes: list[Outcome]) -> Checks:
    """Checks over all outcomes.

    Growth is relative to the largest of the trained motions: a body cannot move or deform twice as far. Settings
    coarser than one step per frame or a tolerance of 1e-2 are counted separately. How far a rolling body gets follows
    from the mechanics, and is not limited.
    """
    largest = _trained(predictor)
    of_body = [
        (case, outcome) for case, outcome in zip(cases, outcomes, strict=True) if outcome.moved and case.shape == "body"
    ]
    # (cases, 2, times)
    window = predictor.schema.window
    passed = window.passed(window.soft_clamped(window.stop * np.array(MOMENTS)))
    allowed = np.stack([largest[0] * passed, largest[1] * np.ones(len(passed))])
    growth = np.array([np.divide((outcome.moved, outcome.deformed), allowed) for _, outcome in of_body])
    coarse = np.array([_coarse(case, predictor.schema.window) for case, _ in of_body])
    sound = growth[~coarse]
    limited = sound[:, isinstance(predictor, RollingModel) :]
    diverged = (limited > 2.0).any(axis=(0, 1))
    distance = {} if isinstance(predictor, RollingModel) else {"distance_growth": Check(float(sound[:, 0].max()), 2.0)}
    return {
        "faults": Check(sum(outcome.status.startswith("fault") for outcome in outcomes), 0),
        "non_finite_frames": Check(sum(outcome.non_finite for outcome in outcomes), 0),
        "start_off_m": Check(max(outcome.start_error for outcome in outcomes), 0.0),
        "slowest_case_s": Check(max(outcome.seconds for outcome in outcomes), PATIENCE),
        **distance,
        "deformation_growth": Check(float(sound[:, 1].max()), 2.0),
        "deformation_growth_of_coarse_solvers": Check(float(growth[:, 1].max()), 2.0),
        "until_divergence_windows": Check(MOMENTS[diverged.argmax() if diverged.any() else -1], MOMENTS[-1], True),
    }


def _trained(predictor: Predictor) -> Floats:
    """(2,) m: largest distance of a point from rest and largest RMS deformation of the trained motions."""
    times, rest, rows = predictor.schema.window.times, subsampled(predictor.rest), []
    for theta in predictor.checkpoint.arrays["training.theta"]:
        units = zip(predictor.schema.learned, theta, strict=True)
        motion = predictor.solve(rest, {p.name: p.denormalise(float(unit)) for p, unit in units})
        moved = np.linalg.norm(motion.vertices(times) - rest.points, axis=2)
        rows.append((moved.max(), motion.deformation_rms(times).max()))
    return np.max(rows, axis=0)


def _coarse(case: Case, window: Window) -> bool:
    quality = case.quality
    if quality is None:
        return False
    return quality.tolerance > 1e-2 if quality.tolerance is not None else (quality.step or 0.0) > 1.01 / window.rate


def report(result: Mapping[str, Any]) -> str:
    """Returns the result as text, one line per status and check."""
    lines = [f"{result['cases']} cases, {result['non_finite_shown']} non-finite frames"]
    lines += [f"{count:>8} {status}" for status, count in result["by_status"].items()]
    if inside := result.get("inside"):
        lines.append(
            f"{inside['draws']} motions inside the trained box, to the end of the time axis: {inside['stopped']} "
            f"stopped, {inside['stopped_in_window']} of them within the trained window"
        )
    for name, check in result["checks"].items():
        figure = "not finite" if check["figure"] is None else f"{check['figure']:.4g}"
        lines.append(f"{'holds' if check['holds'] else 'FAILS'}   {name:<40}{figure:>12}   bound {check['bound']:.4g}")
    return "\n".join(lines)
