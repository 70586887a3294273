"""The state of an ODE over time: integrated once, read out at any time."""

import time
from collections.abc import Callable, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from odeform.cancellation import check_cancelled
from odeform.motion.base import SolveStats
from odeform.motion.reduced_space import motion_rmse
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.method import Field
from odeform.solver.registry import TITLES
from odeform.solver.solution import Solution, Status
from odeform.types import Floats, Times

__all__ = ["Problem", "SolvedTrajectory", "describe"]

MOMENTS = 128  # times at which the error of the solver is measured
FINER = {SolverSettings("dopri5", tolerance=t, dtype="float64"): mm for t, mm in ((1e-6, 1e-4), (1e-9, 0.0))}
"""The finer solutions that errors are measured against -> error in mm from which on each suffices."""


class Problem(NamedTuple):
    """An initial value problem dz/dt = field(t, z) of one motion, and what its states mean."""

    field: Field
    start: Floats
    """(S,) the state at `begin`; its dtype is the precision."""
    readout: Callable[[Times, Floats], Floats]
    """(T,) seconds and states (T, S) there -> coordinates (T, 6 + K) in metres and radians; of n bodies,
    (T, n, 6 + K)."""
    begin: float = 0.0
    """Seconds; at times before it, the readout is given the state at it."""
    at_rest: bool = True
    """Whether the motion begins at rest in zero of its coordinates."""


class SolvedTrajectory:
    """A solved state z(t), read out at the requested times. Later times extend it; nothing solved ever changes.

    Where adaptive steps fail, the fixed steps of `fallback` take over from the last good state.
    """

    def __init__(
        self,
        problem: Problem,
        settings: SolverSettings,
        fallback: SolverSettings,
        until: float,
        gyration_radius: float,
        precise: Callable[[], Problem],
        finer: Mapping[SolverSettings, float] = MappingProxyType(FINER),
    ) -> None:
        """Integrate to `until` seconds.

        `precise` returns the problem in double precision, to measure the error of the solution by `finer` ones
        (`FINER`).
        """
        self._problem, self._precise, self._finer = problem, precise, finer
        self._gyration_radius, self._settings, self._fallback = gyration_radius, settings, fallback
        begin = time.perf_counter()
        with np.errstate(all="ignore"):  # an overflow ends the integration with a status
            self._solution = integrate(problem.field, problem.start, settings, until, begin=problem.begin)
            self._rest: Solution | None = None
            self._extend(until)
        self._wall_ms = 1e3 * (time.perf_counter() - begin)
        self._span = until

    def _extend(self, until: float) -> None:
        """Solve at least to `until` seconds, as far as possible."""
        with self._solution.lock:
            first = integrate(self._problem.field, self._problem.start, self._settings, until, begin=self._solution)
            if first.status is not Status.OK and self._settings.tolerance is not None:
                begin = first.end if self._rest is None else self._rest
                self._rest = integrate(self._problem.field, first.states[-1], self._fallback, until, begin=begin)

    def _sample(self, times: Floats) -> Floats:
        """(T, state) at `times` that are solved."""
        first, rest = self._solution, self._rest
        if rest is None:
            return first.sample(times)
        return np.where((times <= first.end)[:, None], first.sample(times), rest.sample(times))

    @property
    def _last(self) -> Solution:
        return self._solution if self._rest is None else self._rest

    @property
    def last_good(self) -> float:
        """Seconds up to which the integration succeeded."""
        return float("inf") if self._last.status is Status.OK else self._last.end

    def states(self, times: Floats) -> Floats:
        """Maps (T,) seconds to (T, state)."""
        self._extend(float(times.max()))
        return self._sample(times)

    def reduced(self, times: Floats) -> Floats:
        """Maps (T,) seconds to (T, 6 + K), or (T, n, 6 + K) of n bodies; zero at time 0 of a motion that begins
        there."""
        times = np.asarray(times, dtype=float)
        with np.errstate(all="ignore"):
            self._extend(float(times.max()))
        # y(0) = 0 bit-exactly: a product over many rows rounds differently from that over one
        out = self._problem.readout(times, self._sample(times))
        if self._problem.at_rest:
            out = out * (times > 0.0).reshape(-1, *[1] * (out.ndim - 1))
        return out

    @cached_property
    def _error_mm(self) -> float | None:
        """RMS over coordinates, points and the span, in mm: the difference from a finer solution in double precision.

        Where that difference is so small that the finer solution's own error matters, an even finer one is computed.
        """
        if self._last.status is not Status.OK or self._rest is not None:
            return None
        problem = self._precise()
        times = np.linspace(problem.begin, self._span, MOMENTS + 1)[1:]
        mine = self._problem.readout(times, self._solution.sample(times))
        error = None
        for finer, enough in self._finer.items():
            with np.errstate(all="ignore"):
                other = integrate(
                    problem.field, problem.start, finer, self._span, problem.begin, before_step=check_cancelled
                )
            if other.status is not Status.OK:
                break
            truth = problem.readout(times, other.sample(times))
            error = 1e3 * motion_rmse(mine, truth, self._gyration_radius)
            if error >= enough:
                break
        return error

    @property
    def stats(self) -> SolveStats:
        """Solver, steps and elapsed time; if the solver failed, where, and the fixed steps computed instead."""
        first, rest = self._solution, self._rest
        solver, status = describe(self._settings), self._last.status.value
        steps, evaluations = first.steps, first.evaluations
        if rest is not None:
            failed = f"{solver} failed at t = {first.end:.3f} s: {first.status.value}"
            solver = f"{describe(self._fallback)} ({failed})"
            status = "fixed steps" if rest.status is Status.OK else f"fixed steps, {status}"
            steps, evaluations = steps + rest.steps, evaluations + rest.evaluations
        return SolveStats(
            solver=solver,
            steps=steps,
            evaluations=evaluations,
            rejected=first.rejected,
            status=status,
            wall_ms=self._wall_ms,
            estimate=lambda: self._error_mm,
        )


def describe(settings: SolverSettings) -> str:
    """Name the method of a solver with its step or tolerance."""
    title = TITLES.get(settings.method, settings.method)
    if settings.step:
        return f"{title}, steps of {1e3 * settings.step:.3g} ms"
    assert settings.tolerance is not None
    if settings.method == "limex":
        return f"{title}, tolerance {1e3 * settings.tolerance:.2g} mm"
    return f"{title}, tolerance {settings.tolerance:g}"
