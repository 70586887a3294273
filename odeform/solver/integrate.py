"""Explicit Runge-Kutta integration with fixed or controlled steps, dense in time.

The solver knows nothing of models: it takes a callable, and gives a `Solution` with a status instead of raising.
Steps follow from the start, the method and its step or tolerance alone. They never depend on the times asked for,
nor on where the integration is to end: the last step may reach beyond. A solution can therefore be continued, and
what it says of a time is the same however one came to ask.
"""

import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.solver.solution import Solution, Status
from odeform.solver.stages import Field, Stages, TensorStages
from odeform.solver.tableau import Tableau, get_method

__all__ = ["Quality", "integrate"]

MAX_STEPS = 20_000
SAFETY, SHRINK, GROW = 0.9, 0.2, 5.0


@dataclass(frozen=True)
class Quality:
    """A way to integrate: a method with a fixed `step` in seconds, or with a relative `tolerance`, in a precision."""

    method: str
    step: float | None = None
    tolerance: float | None = None
    dtype: str = "float32"

    def __post_init__(self) -> None:
        method = get_method(self.method)
        if (self.step is None) == (self.tolerance is None):
            raise InputError("quality: expected either a step or a tolerance")
        if self.step is not None and not self.step > 0.0:
            raise InputError(f"quality: expected a positive step, got {self.step}")
        if self.tolerance is not None and (method.error is None or not self.tolerance > 0.0):
            raise InputError(f"quality: {self.method} cannot control its step with tolerance {self.tolerance}")
        if self.dtype not in ("float32", "float64"):
            raise InputError(f"quality: expected float32 or float64, got {self.dtype}")

    def to_json(self) -> dict[str, Any]:
        """What differs from the defaults: `Quality(**q.to_json()) == q`."""
        return {f.name: getattr(self, f.name) for f in fields(self) if getattr(self, f.name) != f.default}


def _finite(value: Any) -> bool:
    # the sum is finite only if every entry is (or they overflow together): one pass, numpy and torch alike
    return math.isfinite(value.sum().item())


def _error_ratio(error: Any, before: Any, after: Any, tolerance: float) -> float:
    scaled = (error / (1.0 + np.maximum(np.abs(before), np.abs(after)))).ravel()
    return math.sqrt(float(scaled @ scaled) / scaled.size) / tolerance


def _first_step(method: Tableau, field: Field, time: float, state: Any, slope: Any, tolerance: float) -> float:
    """Hairer, Norsett & Wanner, Solving ODEs I, II.4."""
    scale = tolerance * (1.0 + np.abs(state))
    d0, d1 = (float(np.sqrt(np.mean((x / scale) ** 2))) for x in (state, slope))
    h0 = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    bent = field(time + h0, state + h0 * slope)
    d2 = float(np.sqrt(np.mean(((bent - slope) / scale) ** 2))) / h0
    steep = max(d1, d2)
    h1 = max(1e-6, 1e-3 * h0) if steep <= 1e-15 else (0.01 / steep) ** (1.0 / method.order)
    return min(100.0 * h0, h1)


def integrate(field: Field, start: Any, quality: Quality, until: float, begin: float | Solution = 0.0) -> Solution:
    """Integrate dz/dt = field(t, z) at least to `until` seconds.

    The precision is that of `start`, the state at time `begin`; given a Solution as `begin`, that one is continued in
    place. States are numpy arrays, or torch tensors with fixed steps (differentiable; all of a batch share the steps).
    """
    if isinstance(begin, Solution):
        solution = begin
    else:
        solution = Solution([begin], [start], [field(begin, start)], evaluations=1)
        if not (_finite(solution.states[0]) and _finite(solution.slopes[0])):
            solution.status = Status.NON_FINITE
    if solution.status is Status.OK:
        method = get_method(quality.method)
        stages = (Stages if isinstance(start, np.ndarray) else TensorStages)(method, start)
        advance = _fixed if quality.step is not None else _controlled
        advance(method, stages, field, quality, solution, until)
    return solution


def _fixed(_: Tableau, stages: Stages, field: Field, quality: Quality, solution: Solution, until: float) -> None:
    step, origin = quality.step or 0.0, solution.times[0]
    while solution.end < until - 1e-9 * step:
        if solution.steps >= MAX_STEPS:
            solution.status = Status.MAX_STEPS
            return
        time, state, slope = solution.times[-1], solution.states[-1], solution.slopes[-1]
        after, slope = stages.step(field, time, state, slope, step)
        solution.evaluations += stages.evaluations
        if not _finite(after + slope):
            solution.status = Status.NON_FINITE
            return
        # nodes are multiples of the step: no drift, however often the solution is continued
        solution.times.append(origin + (solution.steps + 1) * step)
        solution.states.append(after)
        solution.slopes.append(slope)


def _controlled(
    method: Tableau, stages: Stages, field: Field, quality: Quality, solution: Solution, until: float
) -> None:
    """Proportional step control on the embedded error estimate."""
    tolerance = quality.tolerance or 0.0
    if not solution.next_step:
        solution.next_step = _first_step(method, field, solution.end, solution.states[0], solution.slopes[0], tolerance)
        solution.evaluations += 1
    while solution.end < until:
        if solution.steps + solution.rejected >= MAX_STEPS:
            solution.status = Status.MAX_STEPS
            return
        time, state, slope, step = solution.times[-1], solution.states[-1], solution.slopes[-1], solution.next_step
        if time + step <= time:
            solution.status = Status.UNDERFLOW
            return
        after, slope = stages.step(field, time, state, slope, step)
        solution.evaluations += stages.evaluations
        ratio = _error_ratio(stages.error(state, step), state, after, tolerance)
        if not math.isfinite(ratio):
            ratio = 1e6  # too far: try again closer
        factor = min(GROW, max(SHRINK, SAFETY * max(ratio, 1e-10) ** (-1.0 / method.order)))
        solution.next_step = step * factor
        if ratio > 1.0:
            solution.rejected += 1
            continue
        solution.times.append(time + step)
        solution.states.append(after)
        solution.slopes.append(slope)
        if method.middle is not None:
            solution.middles.append(stages.middle(state, step))
