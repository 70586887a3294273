"""Integration of many initial value problems at once, each with steps of its own.

Every problem takes the steps that `odeform.solver.integrate.integrate` would take with it alone: what else is in a
batch changes neither them nor its solution, beyond rounding in its field. What is shared is the field's arithmetic, in
which one call for many states takes a fraction of many calls.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from odeform.errors import InputError
from odeform.solver.batch_steps import BatchField, BatchStepper, Together, batch_stepper, rms
from odeform.solver.compiled import CompiledField, Nodes, Rule, solve_together
from odeform.solver.integrate import SolverSettings
from odeform.solver.method import Method
from odeform.solver.registry import get_method
from odeform.solver.runge_kutta import ExplicitRungeKutta
from odeform.solver.solution import Status, between, hermite_weights
from odeform.solver.step_control import GAINS, GROW, MAX_STEPS, SAFETY, SHRINK
from odeform.types import Floats, Times

__all__ = ["BatchSolution", "integrate_batch"]


@dataclass
class BatchSolution:
    """B trajectories of C nodes at most, of which `counts` (B,) are there; the times of others are infinite.

    What belongs to a node, and what lies between nodes, is as in `odeform.solver.solution.Solution`.
    """

    times: Float[np.ndarray, "batch nodes"]
    states: Float[np.ndarray, "batch nodes state"]
    slopes: Float[np.ndarray, "batch nodes state"]
    middles: Float[np.ndarray, "batch nodes state"] | None
    counts: Int[np.ndarray, " batch"]
    evaluations: Int[np.ndarray, " batch"]
    rejected: Int[np.ndarray, " batch"]
    statuses: list[Status]

    @property
    def steps(self) -> Int[np.ndarray, " batch"]:
        """(B,) accepted steps."""
        return self.counts - 1

    @property
    def ok(self) -> Bool[np.ndarray, " batch"]:
        """(B,) whether the integration reached the end that was asked for."""
        return np.array([status is Status.OK for status in self.statuses])

    def sample(self, times: Times) -> Float[np.ndarray, "batch times state"]:
        """(B, T, n) states at `times` (T,) s, clamped to what is integrated."""
        times = np.asarray(times, dtype=float)
        index = np.stack([np.searchsorted(nodes, times, side="right") for nodes in self.times]) - 1
        index = np.clip(index, 0, np.maximum(self.counts - 2, 0)[:, None])
        each = np.arange(len(index))[:, None]
        following = np.minimum(index + 1, self.counts[:, None] - 1)
        begin = self.times[each, index]
        with np.errstate(invalid="ignore", divide="ignore"):
            step = self.times[each, following] - begin
            s = np.where(step > 0.0, np.clip((times - begin) / step, 0.0, 1.0), 0.0)
        weights = [np.asarray(w).astype(self.states.dtype)[..., None] for w in hermite_weights(s, step)]
        middle = None if self.middles is None else self.middles[each, index]
        y0, y1, f0, f1 = (rows[each, at] for rows in (self.states, self.slopes) for at in (index, following))
        return between(weights, y0, y1, f0, f1, middle)

    def _append(self, rows: Any, times: Any, states: Any, slopes: Any, middles: Any | None) -> None:
        at = self.counts[rows]
        if at.max(initial=0) >= self.times.shape[1]:
            self._double()
        self.times[rows, at], self.states[rows, at], self.slopes[rows, at] = times, states, slopes
        if self.middles is not None:
            self.middles[rows, at - 1] = middles
        self.counts[rows] += 1

    def _double(self) -> None:
        self.times = np.concatenate([self.times, np.full_like(self.times, np.inf)], axis=1)
        for name in ("states", "slopes") if self.middles is None else ("states", "slopes", "middles"):
            known = getattr(self, name)
            setattr(self, name, np.concatenate([known, np.zeros_like(known)], axis=1))


def integrate_batch(
    field: BatchField,
    start: Float[np.ndarray, "batch state"],
    quality: SolverSettings,
    until: float,
    before_step: Callable[[], None] = lambda: None,
    begin: float = 0.0,
) -> BatchSolution:
    """Integrate dz/dt = field(rows, t, z) from states `start` (B, n) at `begin` seconds, at least to `until` seconds.

    The dtype of `start` is the precision, single or double. `before_step` is called before each step of those that are
    not at the end, and may raise. A failure ends that problem alone, with a status other than OK. `InputError` for a
    method that needs a field with steps of its own, and for a precision that no settings have.
    """
    if start.dtype.char not in "fd":
        raise InputError(f"batch: expected states in float32 or float64, got {start.dtype}")
    method, rows = get_method(quality.method), np.arange(len(start))
    if isinstance(field, Together) and isinstance(method, ExplicitRungeKutta):
        fields = [each for each in field.fields if isinstance(each, CompiledField)]
        if len(fields) == len(start):
            rule = Rule(method.tableau, quality.step, quality.tolerance, MAX_STEPS)
            start = start.astype(fields[0].dtype)
            nodes = Nodes.begin(np.full(len(start), begin), start, np.zeros_like(start), rule.bends)
            return _found(solve_together(fields, nodes, rule, begin, until, before_step), rule.bends)
    with np.errstate(all="ignore"):  # an overflow ends an integration with a status
        slopes = field(rows, np.full(len(start), begin), start)
        bends = method.knows_middle and quality.tolerance is not None
        solution = _found(Nodes.begin(np.full(len(start), begin), start, slopes, bends), bends)
        solution.evaluations[:] = 1
        _fail(solution, rows, ~(_finite(start) & _finite(slopes)), Status.NON_FINITE)
        rows = rows[solution.ok] if until > begin else rows[:0]
        stepper = batch_stepper(method, field, start)
        times = solution.times[rows, 0]
        run = _Run(field, stepper, solution, until, before_step, rows, times, start[rows], slopes[rows])
        if quality.step is not None:
            run.fixed(quality.step)
        else:
            run.controlled(method, quality.tolerance or 0.0)
    return solution


def _found(nodes: Nodes, bends: bool) -> BatchSolution:
    known = nodes.middles if bends else None
    _, rejected, evaluations = nodes.tallies.T
    parts = nodes.times, nodes.states, nodes.slopes, known, nodes.counts, evaluations, rejected
    return BatchSolution(*parts, nodes.statuses)


def _finite(values: Floats) -> Bool[np.ndarray, " rows"]:
    return np.isfinite(values.sum(axis=1))


def _powers(values: Floats, exponent: float) -> Floats:
    # numpy's powers of arrays differ from those of numbers in the last bit, which step control amplifies
    return np.array([value**exponent for value in values.tolist()])


def _fail(solution: BatchSolution, rows: Any, failed: Any, status: Status) -> None:
    for row in rows[failed].tolist():
        solution.statuses[row] = status


@dataclass
class _Run:
    """The problems that are not at their end yet: indices `rows` (R,), times (R,), states (R, n) and slopes (R, n)."""

    field: BatchField
    stepper: BatchStepper
    solution: BatchSolution
    until: float
    before_step: Callable[[], None]
    rows: Any
    time: Any
    state: Any
    slope: Any

    def _keep(self, kept: Any, *others: Any) -> tuple[Any, ...]:
        """Go on with some of the problems; also returns these entries of `others`."""
        if kept.all():
            return others
        self.rows, self.time, self.state, self.slope = (
            values[kept] for values in (self.rows, self.time, self.state, self.slope)
        )
        return tuple(values[kept] for values in others)

    def _step(self, steps: Any) -> tuple[Any, Any]:
        self.solution.evaluations[self.rows] += self.stepper.evaluations
        return self.stepper.step(self.field, self.rows, self.time, self.state, self.slope, steps)

    def _accept(self, good: Any, time: Any, state: Any, slope: Any, middle: Any | None) -> None:
        self.time = np.where(good, time, self.time)
        each = good[:, None]
        self.state, self.slope = np.where(each, state, self.state), np.where(each, slope, self.slope)
        middle = None if middle is None else middle[good]
        self.solution._append(self.rows[good], time[good], state[good], slope[good], middle)

    def fixed(self, step: float) -> None:
        """Steps of one length."""
        solution, begin = self.solution, self.solution.times[0, 0]
        self._keep(self.time < self.until - 1e-9 * step)
        while len(self.rows):
            if solution.steps[self.rows[0]] >= MAX_STEPS:  # all of them have taken as many
                _fail(solution, self.rows, slice(None), Status.MAX_STEPS)
                return
            self.before_step()
            after, slope = self._step(np.full(len(self.rows), step))
            good = _finite(after + slope)
            _fail(solution, self.rows, ~good, Status.NON_FINITE)
            self._accept(good, begin + (solution.steps[self.rows] + 1) * step, after, slope, None)
            self._keep(good & (self.time < self.until - 1e-9 * step))

    def controlled(self, method: Method, tolerance: float) -> None:
        """Proportional-integral step control on the embedded error estimate, as of a single problem."""
        solution, order = self.solution, method.order
        first, second = (gain / order for gain in getattr(method, "gains", GAINS))
        steps = self._first_steps(order, tolerance) if len(self.rows) else np.zeros(0)
        last, longest = np.ones(len(steps)), np.full(len(steps), GROW)
        while len(self.rows):
            spent = solution.steps[self.rows] + solution.rejected[self.rows] >= MAX_STEPS
            stuck = ~spent & (self.time + steps <= self.time)
            _fail(solution, self.rows, spent, Status.MAX_STEPS)
            _fail(solution, self.rows, stuck, Status.UNDERFLOW)
            steps, last, longest = self._keep(~(spent | stuck), steps, last, longest)
            if not len(self.rows):
                return
            self.before_step()
            after, slope = self._step(steps)
            ratio = np.maximum(self.stepper.errors(steps) / tolerance, 1e-10)
            good = ratio <= 1.0
            ratio = np.where(np.isfinite(ratio), ratio, 1e6)  # overflow: retry with a much smaller step
            shrunk = np.maximum(SHRINK, SAFETY * _powers(ratio, -1.0 / order))
            grown = SAFETY * _powers(ratio, -first) * _powers(last, second)
            factor = np.minimum(longest, np.maximum(SHRINK, grown))
            middle = self.stepper.middles(self.state, steps) if solution.middles is not None else None
            solution.rejected[self.rows[~good]] += 1
            self._accept(good, self.time + steps, after, slope, middle)
            steps = steps * np.where(good, factor, shrunk)
            last = np.where(good, np.maximum(ratio, 1e-4), last)
            longest = np.where(good, GROW, 1.0)
            steps, last, longest = self._keep(self.time < self.until, steps, last, longest)

    def _first_steps(self, order: int, tolerance: float) -> Floats:
        """(R,) s, as of a single problem."""
        state, slope = self.state, self.slope
        d0, d1 = rms(state) / tolerance, rms(slope) / tolerance
        h0 = np.where((d0 < 1e-5) | (d1 < 1e-5), 1e-6, 0.01 * d0 / d1)
        bent = self.field(self.rows, self.time + h0, state + h0[:, None].astype(state.dtype) * slope)
        self.solution.evaluations[self.rows] += 1
        steep = np.maximum(d1, rms(bent - slope) / tolerance / h0)
        h1 = np.where(steep <= 1e-15, np.maximum(1e-6, 1e-3 * h0), _powers(0.01 / steep, 1.0 / order))
        return np.minimum(100.0 * h0, h1)
