"""Integration by one-step methods with fixed or controlled steps, dense in time.

The solver knows nothing about models: it takes a callable, and returns a `Solution` with a status instead of raising.
Steps depend on the initial state, the method, and its step or tolerance only. They do not depend on query times or on
the end of the integration, which the last step may exceed. A solution can therefore be continued, and its state at a
time does not depend on earlier queries.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.solver.compiled import CompiledField, Rule
from odeform.solver.linearly_implicit import LinearlyImplicit
from odeform.solver.method import Field, Method, Stepper
from odeform.solver.registry import get_method
from odeform.solver.runge_kutta import ExplicitRungeKutta
from odeform.solver.solution import Solution, Status
from odeform.solver.step_control import GAINS, GROW, MAX_STEPS, SAFETY, SHRINK
from odeform.solver.stiff_steps import FollowedField, follow

__all__ = ["SolverSettings", "integrate"]


@dataclass(frozen=True)
class SolverSettings:
    """A method of integration, with a fixed step or with a tolerance, and its precision.

    Raises:
        InputError: An unknown method, not exactly one of step and tolerance, or one that is not positive.

    Examples:
        >>> import odeform
        >>> predictor = odeform.load("mass-elastic")
        >>> predictor.qualities["balanced"]
        SolverSettings(method='bosh3', step=None, tolerance=0.004, dtype='float32')
        >>> fine = odeform.SolverSettings("rk4", step=1 / 480)
        >>> predictor.solve(quality=fine).stats.steps
        600
    """

    method: str
    """A name in `odeform.solver.registry.METHODS`."""
    step: float | None = None
    """Fixed step in seconds."""
    tolerance: float | None = None
    """Bound on the estimated error of a step, as the root mean square over the entries of the state. It is absolute:
    relative to the state, errors of large entries would be decoded into large errors of the motion. For
    `limex` it is in m, as the field estimates it."""
    dtype: str = "float32"
    """"float32" or "float64"."""

    def __post_init__(self) -> None:
        method = get_method(self.method)
        if (self.step is None) == (self.tolerance is None):
            raise InputError("quality: expected either a step or a tolerance")
        if self.step is not None and not self.step > 0.0:
            raise InputError(f"quality: expected a positive step, got {self.step}")
        if self.tolerance is not None and (not method.controls_step or not self.tolerance > 0.0):
            raise InputError(f"quality: {self.method} cannot control its step with tolerance {self.tolerance}")
        if self.dtype not in ("float32", "float64"):
            raise InputError(f"quality: expected float32 or float64, got {self.dtype}")

    def to_json(self) -> dict[str, Any]:
        """The values that differ from the defaults: `SolverSettings(**q.to_json()) == q`."""
        return {f.name: getattr(self, f.name) for f in fields(self) if getattr(self, f.name) != f.default}


def _finite(value: Any) -> bool:
    # one pass: the sum is finite only if every entry is (or their sum overflows)
    return math.isfinite(value.sum().item())


def _rms(values: Any) -> float:
    return math.sqrt(float(values.dot(values)) / values.size)


def _first_step(order: int, field: Field, time: float, state: Any, slope: Any, tolerance: float) -> float:
    """Hairer, Norsett & Wanner, Solving ODEs I, II.4."""
    d0, d1 = (_rms(x) / tolerance for x in (state, slope))
    h0 = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    bent = field(time + h0, state + h0 * slope)
    d2 = _rms(bent - slope) / tolerance / h0
    steep = max(d1, d2)
    h1 = max(1e-6, 1e-3 * h0) if steep <= 1e-15 else (0.01 / steep) ** (1.0 / order)
    return min(100.0 * h0, h1)


def integrate(
    field: Field,
    start: Any,
    quality: SolverSettings,
    until: float,
    begin: float | Solution = 0.0,
    before_step: Callable[[], None] = lambda: None,
) -> Solution:
    """Integrate dz/dt = field(t, z) at least to `until` seconds.

    `start` (n,) is the state at time `begin` in seconds; its dtype is the precision. A `Solution` given as `begin` is
    continued in place, by one thread at a time. `before_step` is called before each step, and may raise
    (`check_cancelled`). Failures end the solution early with a status other than OK; nothing else is raised.
    """
    method = get_method(quality.method)
    if isinstance(field, CompiledField) and isinstance(method, ExplicitRungeKutta):
        solution = begin if isinstance(begin, Solution) else Solution([begin], [start], [np.zeros_like(start)])
        rule = Rule(method.tableau, quality.step, quality.tolerance, MAX_STEPS)
        field.extend(solution, rule, until, before_step)
        return solution
    if isinstance(begin, Solution):
        solution = begin
    else:
        solution = Solution([begin], [start], [field(begin, start)], evaluations=1)
        if not (_finite(solution.states[0]) and _finite(solution.slopes[0])):
            solution.status = Status.NON_FINITE
    with solution.lock:
        if solution.status is Status.OK and solution.end < until:
            stepper = method.stepper(start)
            if quality.step is not None:
                _fixed(stepper, field, quality.step, solution, until, before_step)
            else:
                _controlled(method, stepper, field, quality.tolerance or 0.0, solution, until, before_step)
    return solution


def _fixed(
    stepper: Stepper, field: Field, step: float, solution: Solution, until: float, before_step: Callable[[], None]
) -> None:
    origin = solution.times[0]
    while solution.end < until - 1e-9 * step:
        if solution.steps >= MAX_STEPS:
            solution.status = Status.MAX_STEPS
            return
        before_step()
        time, state, slope = solution.times[-1], solution.states[-1], solution.slopes[-1]
        after, slope = stepper.step(field, time, state, slope, step)
        solution.evaluations += stepper.evaluations
        if not _finite(after + slope):
            solution.status = Status.NON_FINITE
            return
        # nodes are multiples of the step: no drift, however often the solution is continued
        solution.append(origin + (solution.steps + 1) * step, after, slope)


def _controlled(
    method: Method,
    stepper: Stepper,
    field: Field,
    tolerance: float,
    solution: Solution,
    until: float,
    before_step: Callable[[], None],
) -> None:
    """Proportional-integral step control on the embedded error estimate."""
    first, second = (gain / method.order for gain in getattr(method, "gains", GAINS))
    if not solution.next_step:
        begin, state, slope = solution.end, solution.states[0], solution.slopes[0]
        solution.next_step = _first_step(method.order, field, begin, state, slope, tolerance)
        solution.evaluations += 1
    if isinstance(method, LinearlyImplicit) and isinstance(field, FollowedField) and (steps := field.follow):
        follow(steps, method, tolerance, solution, until, before_step)
        return
    longest = GROW
    while solution.end < until:
        if solution.steps + solution.rejected >= MAX_STEPS:
            solution.status = Status.MAX_STEPS
            return
        before_step()
        time, state, slope, step = solution.times[-1], solution.states[-1], solution.slopes[-1], solution.next_step
        if time + step <= time:
            solution.status = Status.UNDERFLOW
            return
        after, slope = stepper.step(field, time, state, slope, step)
        solution.evaluations += stepper.evaluations
        ratio = max(_rms(stepper.error(step)) / tolerance, 1e-10)
        if not ratio <= 1.0:
            if not math.isfinite(ratio):
                ratio = 1e6  # overflow: retry with a much smaller step
            solution.next_step = step * max(SHRINK, SAFETY * ratio ** (-1.0 / method.order))
            solution.rejected += 1
            longest = 1.0
            continue
        factor = SAFETY * ratio**-first * solution.last_ratio**second
        solution.next_step = step * min(longest, max(SHRINK, factor))
        solution.last_ratio, longest = max(ratio, 1e-4), GROW
        middle = stepper.middle(state, step) if method.knows_middle else None
        solution.append(time + step, after, slope, middle)
