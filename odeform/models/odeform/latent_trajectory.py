"""The latent state of an object over time: integrated once, decoded at any time."""

import time
from functools import cached_property

import numpy as np

from odeform.models.odeform.inference import Decoder
from odeform.motion.base import SolveStats
from odeform.motion.recent import Recent
from odeform.motion.reduced_space import small_motion
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.method import Field
from odeform.solver.registry import get_method
from odeform.solver.solution import Solution, Status
from odeform.types import Floats

__all__ = ["LatentTrajectory"]

ROUNDING_MM = 1e-3  # of states in single precision: `odeform stress` finds about half as much
RECENT = 4  # results that are kept: pose, deformation and gradient of a time are evaluated one after the other


class LatentTrajectory:
    """A solved state z(t), decoded at the requested times. Later times extend it; nothing solved ever changes.

    Where adaptive steps fail, the fixed steps of `fallback` take over from the last good state.
    """

    def __init__(
        self,
        field: Field,
        decode: Decoder,
        start: Floats,
        quality: SolverSettings,
        fallback: SolverSettings,
        until: float,
        gyration_radius: float,
    ) -> None:
        """Integrate from `start` (state,) at time 0 to `until` seconds."""
        self._field, self._decode, self._gyration_radius = field, decode, gyration_radius
        self._quality, self._fallback = quality, fallback
        begin = time.perf_counter()
        with np.errstate(all="ignore"):  # an overflow ends the integration with a status
            self._solution, self._rest = integrate(field, start, quality, until), None
            self._extend(until)
        self._wall_ms = 1e3 * (time.perf_counter() - begin)
        self._origin = decode(np.zeros(1), start[None])
        self._span = until
        self._recent: Recent[Floats] = Recent(RECENT)

    def _extend(self, until: float) -> None:
        """Solve at least to `until` seconds, as far as possible."""
        first = integrate(self._field, self._solution.states[0], self._quality, until, begin=self._solution)
        if first.status is not Status.OK and self._quality.tolerance is not None:
            begin = first.end if self._rest is None else self._rest
            self._rest = integrate(self._field, first.states[-1], self._fallback, until, begin=begin)

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

    def reduced(self, times: Floats) -> Floats:
        """(T,) seconds -> (T, 6 + K), read-only; zero at time 0."""
        requested = np.asarray(times, dtype=float)
        return self._recent.get(requested.tobytes(), lambda: self._decoded(requested))

    def _decoded(self, times: Floats) -> Floats:
        with np.errstate(all="ignore"):
            self._extend(float(times.max()))
        # y(0) = 0 bit-exactly: a product over many rows rounds differently from that over one
        y = (self._decode(times, self._sample(times)) - self._origin) * (times > 0.0)[:, None]
        y.flags.writeable = False
        return y

    @cached_property
    def _error_mm(self) -> float | None:
        """Step doubling (Hairer, Norsett & Wanner, Solving ODEs I, II.4): largest error over the span, in RMS mm.

        The same integration with twice the step, or ten times the tolerance, differs from this one by a multiple of
        its error: 2^p - 1 or 9 in the limit of small steps, less where the field bends within a step, at the kick and
        at landings. Divided by 2 (Euler: 1) or 6, it overestimates rather than underestimates the error of such
        motions. Rounding in single precision, which both share, is added.
        """
        quality = self._quality
        if quality.step is not None:
            coarse = SolverSettings(quality.method, step=2.0 * quality.step)
            share = min(2.0, 2.0 ** get_method(quality.method).order - 1.0)
        else:
            coarse, share = SolverSettings(quality.method, tolerance=10.0 * (quality.tolerance or 0.0)), 6.0
        with np.errstate(all="ignore"):
            other = integrate(self._field, self._solution.states[0], coarse, self._span)
        if other.status is not Status.OK or self._solution.status is not Status.OK:
            return None
        times = np.linspace(0.0, self._span, 129)[1:]
        difference = self._decode(times, self._solution.sample(times)) - self._decode(times, other.sample(times))
        rounding = ROUNDING_MM if quality.dtype == "float32" else 0.0
        return float(1e3 * small_motion(difference, self._gyration_radius).max() / share) + rounding

    @property
    def stats(self) -> SolveStats:
        """Solver, steps and elapsed time; if the solver failed, where, and the fixed steps computed instead."""
        first, rest = self._solution, self._rest
        solver, status = _describe(self._quality), self._last.status.value
        steps, evaluations = first.steps, first.evaluations
        if rest is not None:
            failed = f"{solver} failed at t = {first.end:.3f} s: {first.status.value}"
            solver = f"{_describe(self._fallback)} ({failed})"
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


def _describe(settings: SolverSettings) -> str:
    value = f"h = {1e3 * settings.step:.3g} ms" if settings.step else f"tol {settings.tolerance:.0e}"
    return f"{settings.method}, {value}"
