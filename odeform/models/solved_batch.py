"""States of many motions over time: integrated together, read out at any time."""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from odeform.cancellation import check_cancelled
from odeform.models.solved import describe
from odeform.motion.base import SolveStats
from odeform.solver.batch import BatchSolution, integrate_batch
from odeform.solver.batch_steps import BatchField
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Times

__all__ = ["BatchProblem", "BatchReadout", "SolvedBatch"]

BatchReadout = Callable[[Times, Floats], Floats]
"""(T,) seconds and states (B, T, n) -> coordinates (B, T, 6 + K) in metres and radians."""


class BatchProblem(NamedTuple):
    """Many initial value problems, as `Problem` has one."""

    field: BatchField
    start: Float[np.ndarray, "batch state"]
    readout: BatchReadout
    begin: float = 0.0
    """Seconds."""
    at_rest: bool = True
    """As of `Problem`."""


class SolvedBatch:
    """Solves many motions as `SolvedTrajectory` does one, without the fixed steps that take over where a solver
    fails."""

    def __init__(
        self, make: Callable[[], BatchProblem], settings: SolverSettings, until: float, least: float = 0.0
    ) -> None:
        """`make` states the problems, which are solved to `until` seconds, and `least` seconds from where they begin.
        It is called again for later times: what fields hold may be large."""
        self._make, self._settings, self._until, self._least = make, settings, until, least
        begin = time.perf_counter()
        self._solution, self._readout = self._solved(until)
        self._wall_ms = 1e3 * (time.perf_counter() - begin)

    def _solved(self, until: float) -> tuple[BatchSolution, BatchReadout]:
        field, start, readout, begin, self._at_rest = self._make()
        until = max(until, begin + self._least)
        return integrate_batch(field, start, self._settings, until, check_cancelled, begin), readout

    @property
    def ok(self) -> Bool[np.ndarray, " batch"]:
        """(B,) whether motions are solved as far as they were asked for."""
        return self._solution.ok

    @property
    def stats(self) -> list[SolveStats]:
        """(B,) the solver, and an equal part of the time that all of them took."""
        found, solver = self._solution, describe(self._settings)
        wall = self._wall_ms / len(found.counts)
        steps, evaluations, rejected = (counts.tolist() for counts in (found.steps, found.evaluations, found.rejected))
        return [
            SolveStats(solver, steps[i], evaluations[i], rejected[i], status.value, wall, lambda: None)
            for i, status in enumerate(found.statuses)
        ]

    def states(self, times: Times) -> Float[np.ndarray, "batch times state"]:
        """Maps (T,) seconds to (B, T, n)."""
        latest = float(times.max())
        if latest > self._until:
            # steps do not depend on the end: up to here, they are as they were
            self._solution, self._readout = self._solved(latest)
            self._until = latest
        return self._solution.sample(times)

    def reduced(self, times: Times) -> Float[np.ndarray, "batch times y"]:
        """Maps (T,) seconds to (B, T, 6 + K); zero at time 0 of motions that begin there."""
        states = self.states(times)
        return self._readout(times, states) * ((times > 0.0)[:, None] | (not self._at_rest))
