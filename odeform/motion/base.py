"""A motion: a time in, points and poses out."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from odeform.errors import InputError
from odeform.geometry.shape_similarity import ShapeSimilarity
from odeform.motion.plausibility import PlausibilityCheck, Stop
from odeform.motion.remade import Remade
from odeform.motion.validity import UNKNOWN, Validity
from odeform.schema import Parameters, Schema
from odeform.types import Floats, Frames, Geometry, Matrices, Points, Pose, Times

__all__ = ["LATEST", "Motion", "SolveStats", "checked_times"]

LATEST = 10.0
"""Trained windows after which the clock of every model has stopped."""
FEW = 20_000  # points whose frames are moved faster than a body is solved


def checked_times(t: float | Times) -> Times:
    """Return `t`, a number or (T,) seconds, as (T,) seconds, of which there may be none; `InputError` for NaN."""
    times = np.atleast_1d(np.asarray(t, dtype=float))
    if times.ndim != 1 or np.isnan(times).any():
        raise InputError(f"time: expected seconds, a number or (T,) of them, got {np.array2string(times, threshold=5)}")
    return times


@dataclass(frozen=True)
class SolveStats:
    """How a motion was computed.

    Attributes:
        solver: Its name, with the step or tolerance.
        steps: Number of steps taken.
        evaluations: Number of evaluations of the ODE's right-hand side.
        rejected: Number of steps repeated with a smaller step size.
        status: "ok", or why the integration ended early.
        wall_ms: Elapsed time in milliseconds.
        estimate: Computes `solver_error_mm`.
    """

    solver: str
    steps: int
    evaluations: int
    rejected: int
    status: str
    wall_ms: float
    estimate: Callable[[], float | None] = field(repr=False, compare=False)

    @property
    def solver_error_mm(self) -> float | None:
        """Error of the integration in millimetres, without that of the model: RMS over coordinates, points and the span
        that was solved. It is measured against a much finer solution.

        None where nothing is integrated, or the integration failed. Computed on first access, which takes ten times as
        long as an ordinary solution.
        """
        return self.estimate()


class Motion(Remade, ABC):
    """The motion of one geometry under one set of parameters: P(t) = T(t) o D(t)(P0), Eq. 4 of arXiv:2607.20670.

    A rigid motion T follows a local deformation D of the N points P0. Any time can be evaluated, in any order; the
    result does not depend on earlier calls. Points are in scene axes. From where a motion is not physically possible
    (`odeform.motion.plausibility`), the last valid moment is shown, as `status` says.

    One that a predictor solved can be pickled, for other processes of one's own: it is solved again where it is read,
    to the same bits.

    Attributes:
        schema: That of the predictor.
        parameters: All of them, by name.
        geometry: The shape at rest.
        validity: What is known of how far motions of the predictor can be trusted.
        only_at: Seconds of the one moment that is predicted, and shown at all others; None for whole motions.

    Examples:
        >>> import odeform
        >>> motion = odeform.load("kick").solve(parameters={"mass": 0.6, "force": 140.0})
        >>> motion.vertices(0.02).shape  # N points at one time
        (2306, 3)
        >>> import numpy as np
        >>> motion.vertices(np.array([0.0, 0.5])).shape
        (2, 2306, 3)
        >>> motion.pose(0.02).shape, motion.local(0.02).shape
        ((4, 4), (2306, 3))
        >>> motion.stats.status
        'ok'
    """

    schema: Schema
    parameters: Parameters
    geometry: Geometry
    validity: Validity = UNKNOWN
    only_at: float | None = None

    @cached_property
    def plausibility(self) -> PlausibilityCheck | None:
        """Checks that the motion is physically possible; None for motions that are not checked."""
        return self._make_check()

    def _make_check(self) -> PlausibilityCheck | None:
        return None

    @property
    @abstractmethod
    def stats(self) -> SolveStats:
        """Solver, evaluations, elapsed time, status and solver error."""

    @property
    @abstractmethod
    def last_good(self) -> float:
        """Seconds up to which the integration succeeded. Later times return the state at this time."""

    @abstractmethod
    def vertices(self, t: float | Times) -> Points | Frames:
        """Computes (N, 3) float32 metres at time `t` in seconds; (T, N, 3) for (T,) times."""

    @abstractmethod
    def pose(self, t: float | Times) -> Pose:
        """T(t), the rigid part: (4, 4) in scene axes, metres; (T, 4, 4) for (T,) seconds. The identity at rest."""

    def placement(self, t: float | Times) -> Pose:
        """Where `deformed(t)` is put: (4, 4) or (T, 4, 4). The pose, or the identity for what has no single one."""
        return self.pose(t)

    @abstractmethod
    def local(self, t: float | Times) -> Points | Frames:
        """D(t)(P0) - P0, the local displacement in the frame of the body at rest: (N, 3) or (T, N, 3) metres."""

    @abstractmethod
    def deformed(self, t: float) -> Points:
        """Returns D(t)(P0), the deformed body before `placement(t)`, its rigid motion: (N, 3) float32 metres."""

    @abstractmethod
    def covariances(self, t: float) -> Matrices:
        """Returns the covariances of splats at `t` seconds: F S F^T, F the deformation gradient; (N, 3, 3) float32
        m^2."""

    @abstractmethod
    def deformed_covariances(self, t: float) -> Matrices:
        """Returns the covariances of splats before `placement(t)`, those of `deformed(t)`: (N, 3, 3) m^2."""

    @abstractmethod
    def deformation_bound(self, time: float) -> float:
        """Returns an upper bound on the local displacement of every point at `time` seconds, in metres."""

    @abstractmethod
    def deformation_rms(self, times: Times) -> Times:
        """(T,) root-mean-square local displacement over the surface in metres, at (T,) seconds."""

    @cached_property
    def similarity(self) -> ShapeSimilarity | None:
        """How similar the shape is to the trained bodies; None where the checkpoint does not hold them."""
        return self.validity.similarity(self.geometry)

    @property
    def untrained(self) -> bool:
        """Whether the shape is none that was trained. No error is known for the motion of such a shape."""
        similarity = self.similarity
        return similarity is not None and not similarity.same

    def error_band(self, times: Times) -> Floats | None:
        """(T, 2) RMSE in mm at (T,) seconds that half, and nine in ten, of unseen motions stay within. None where it is
        not known, as for most shapes that were not trained."""
        known = not self.untrained or self.validity.knows_untrained_errors
        if not known:
            return None
        # solving the trained body is faster than moving very many points
        size = (lambda: self.size_mm) if len(self.geometry.points) <= FEW else None
        return self.validity.error_band(self.parameters, times, size)

    @cached_property
    def size_mm(self) -> float:
        """RMS displacement of the points in mm over the window, or at the only moment that is known."""
        times = self.schema.window.times[1:] if self.only_at is None else np.array([self.only_at])
        moved = self.vertices(times).astype(float) - self.geometry.points
        return 1e3 * float(np.sqrt((moved**2).mean()))

    def stop_at(self, time: float) -> Stop | None:
        """Says what is shown in place of `time` in seconds, and why; None where that moment itself is shown."""
        clock = float(self.schema.window.soft_clamped(np.array(time)))
        return None if self.plausibility is None else self.plausibility.stop_at(clock)

    def first_stop(self, until: float = np.inf) -> Stop | None:
        """The first moment before `until` in seconds from which on an earlier one is shown; checks all of it."""
        clock = float(self.schema.window.soft_clamped(np.array(min(until, LATEST * self.schema.window.stop))))
        return None if self.plausibility is None else self.plausibility.first_stop(clock)

    @cached_property
    def status(self) -> str:
        """Says the solver's status, and from where on the motion is not physically possible; "ok" if neither says
        more."""
        stop, solver = self.first_stop(), self.stats.status
        return solver if stop is None else f"{'' if solver == 'ok' else f'{solver}; '}{stop}"

    def _clock(self, t: float | Times) -> Times:
        """(T,) seconds of the model's clock at which `t`, a number or (T,) seconds, is evaluated; before it starts, a
        body rests."""
        window = self.schema.window
        clock = window.soft_clamped(np.maximum(checked_times(t), min(window.start, 0.0)))
        return clock if self.plausibility is None else self.plausibility.clamped(clock)

    @property
    def outside(self) -> tuple[str, ...]:
        """Names of the parameters outside their trained range."""
        return self.schema.outside(self.parameters)

    def extrapolates(self, time: float) -> bool:
        """Whether `time` in seconds lies outside the trained window."""
        return not self.schema.window.start <= time <= self.schema.window.stop + 1e-9
