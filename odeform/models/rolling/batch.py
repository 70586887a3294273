"""Motions of many rolling bodies: the field of all at once, and the phases of their motions, as of one."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from odeform.mechanics.rolling.dynamics import RollingDynamics
from odeform.models.reduced_batches import ChangedBatch
from odeform.models.rolling.phases import Push, risen
from odeform.models.solved_batch import SolvedBatch
from odeform.motion.reduced_batch import BatchTrajectory
from odeform.motion.reduced_space import POSE
from odeform.solver.batch_steps import BatchField
from odeform.types import Floats, Ints, Times

__all__ = ["BegunBatch", "ResumedBatch", "batch_field"]

Coordinates = Float[np.ndarray, "batch times y"]


def batch_field(
    dynamics: Callable[[Float[np.ndarray, "rows materials"]], RollingDynamics],
    material: Float[np.ndarray, "batch materials"],
    units: Floats,
) -> BatchField:
    """Fields of bodies of `material` (B, Q), whose `dynamics` are those of some of them, as `make_field` has each."""
    known: tuple[Ints, RollingDynamics] | None = None

    def field(rows: Ints, times: Floats, states: Floats) -> Floats:
        nonlocal known
        if known is None or known[0] is not rows:
            known = rows, dynamics(material[rows])
        plain = states.astype(float) / units
        lost = ~np.isfinite(plain[:, 1:POSE].sum(axis=1))
        plain[lost] = 0.0
        slopes = known[1].slopes(plain.T).T * units
        slopes[lost] = np.nan  # the integration ends there, with a status
        return slopes.astype(states.dtype)

    return field


class BegunBatch(ChangedBatch):
    """As `Begun`, of many motions."""

    def __init__(
        self,
        own: SolvedBatch,
        begin: float,
        first: Float[np.ndarray, "batch y"],
        rates: Float[np.ndarray, "batch 6"],
    ) -> None:
        """`first` and `rates` per second are those at `begin` seconds."""
        super().__init__(own)
        self._solved, self._begin, self._first = own, begin, first
        self._pushes = [Push(begin, y[:POSE], rate) for y, rate in zip(first, rates, strict=True)]

    def states(self, time: float) -> Float[np.ndarray, "batch 8"]:
        """Those of the ODE at `time` seconds, after the push."""
        return self._solved.states(np.array([time - self._begin]))[:, 0]

    def reduced(self, times: Times) -> Coordinates:
        """(T,) s -> (B, T, 6 + S), zero at time 0."""
        later = times > self._begin
        out = np.zeros((len(self._first), len(times), self._first.shape[1]))
        if not later.all():
            out[:, ~later, :POSE] = np.stack([push.at(times[~later]) for push in self._pushes])
        if later.any():
            after = times[later] - self._begin
            out[:, later] = self._first[:, None] + self.own.reduced(after)
            out[:, later, POSE:] *= risen(after)[:, None]
        return out


class ResumedBatch(ChangedBatch):
    """As `Resumed`, of many motions."""

    def __init__(
        self, own: BatchTrajectory, stop: float, resume: Callable[[], tuple[SolvedBatch, Float[np.ndarray, "batch s"]]]
    ) -> None:
        super().__init__(own)
        self._stop, self._resume = stop, resume
        self._later: tuple[SolvedBatch, Coordinates, Floats] | None = None

    @property
    def ok(self) -> Bool[np.ndarray, " batch"]:
        """(B,) of `own`, and of what goes on from it where that was asked for."""
        return self.own.ok if self._later is None else self.own.ok & self._later[0].ok

    def reduced(self, times: Times) -> Coordinates:
        """(T,) s -> (B, T, 6 + S)."""
        out, later = self.own.reduced(np.minimum(times, self._stop)), times > self._stop
        if later.any():
            solved, end, given_up = self._resumed()
            after = times[later] - self._stop
            out = out.copy()
            out[:, later] = end + solved.reduced(after)
            out[:, later, POSE:] -= risen(after)[:, None] * given_up[:, None]
        return out

    def _resumed(self) -> tuple[SolvedBatch, Coordinates, Floats]:
        if self._later is None:
            solved, deformation = self._resume()
            end = self.own.reduced(np.array([self._stop]))
            self._later = solved, end, end[:, 0, POSE:] - deformation
        return self._later
