"""The phases of a rolling body's motion: the push, what is solved from there on, and how a corrected motion goes on."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.models.latent.latent_trajectory import LatentTrajectory
from odeform.motion.changed_trajectory import ChangedTrajectory
from odeform.motion.reduced_motion import Trajectory
from odeform.motion.reduced_space import POSE
from odeform.types import Floats, Times

__all__ = ["Begun", "Push", "Resumed", "risen"]

RISING = 0.04  # s


@dataclass(frozen=True, eq=False)
class Push:
    """The motion during the push: from rest to where the ODE begins, with its velocity there."""

    begin: float
    pose: Float[np.ndarray, "6"]
    rate: Float[np.ndarray, "6"]

    def at(self, times: Times) -> Float[np.ndarray, "times 6"]:
        """(T,) s from 0 to `begin` -> (T, 6): cubic in time."""
        share = (times / self.begin)[:, None]
        ramp = share**2 * (3.0 - 2.0 * share) * self.pose
        return ramp + share**2 * (share - 1.0) * self.begin * self.rate


class Begun(ChangedTrajectory):
    """A motion that is solved from the end of the push on.

    How the push deforms the body does not follow from the motion: it is regressed (`Correction`). What contacts do
    takes its place in `RISING` seconds.
    """

    def __init__(self, own: LatentTrajectory, begin: float, y: Floats, rate: Floats) -> None:
        """`y` (6 + S,) and the pose's `rate` (6,) per second are those at `begin` seconds."""
        super().__init__(own)
        self._solved, self._push, self._first = own, Push(begin, y[:POSE], rate), y

    def state(self, time: float) -> Float[np.ndarray, "8"]:
        """That of the ODE at `time` seconds, after the push."""
        return self._solved.states(np.array([time - self._push.begin]))[0]

    @property
    def last_good(self) -> float:
        """Seconds up to which it is valid."""
        return self._push.begin + self.own.last_good

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """(T,) s -> (T, 6 + S), zero at time 0."""
        times = np.asarray(times, dtype=float)
        push, later = self._push, times > self._push.begin
        out = np.zeros((len(times), len(self._first)))
        out[~later, :POSE] = push.at(times[~later])
        if later.any():
            after = times[later] - push.begin
            out[later] = self._first + self.own.reduced(after)
            out[later, POSE:] *= risen(after)[:, None]
        return out


class Resumed(ChangedTrajectory):
    """A motion that is corrected up to `stop` seconds, and from there on solved from where it is, as it moves there."""

    def __init__(self, own: Trajectory, stop: float, resume: Callable[[], tuple[Trajectory, Floats]]) -> None:
        """`resume` returns what is solved from `stop` on, and its deformation (S,) there; called when it is needed."""
        super().__init__(own)
        self._stop, self._resume = stop, resume

    @cached_property
    def _later(self) -> tuple[Trajectory, Floats, Floats]:
        """What is solved from `stop` on, the coordinates (6 + S,) that are added to it, and what these give up."""
        solved, deformation = self._resume()
        end = self.own.reduced(np.array([self._stop]))[0]
        return solved, end, np.concatenate([np.zeros(POSE), end[POSE:] - deformation])

    @property
    def last_good(self) -> float:
        """Seconds up to which it is valid."""
        if self.own.last_good < self._stop or "_later" not in self.__dict__:
            return self.own.last_good
        return self._stop + self._later[0].last_good

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """(T,) s -> (T, 6 + S)."""
        times = np.asarray(times, dtype=float)
        out, later = self.own.reduced(np.minimum(times, self._stop)), times > self._stop
        if later.any() and self.own.last_good >= self._stop:
            (solved, end, given_up), after = self._later, times[later] - self._stop
            out = out.copy()
            # what the correction adds to the deformation gives way to what follows from the motion
            out[later] = end + solved.reduced(after) - risen(after)[:, None] * given_up
        return out


def risen(after: Times) -> Times:
    """(T,) from 0 to 1, in `RISING` s."""
    share = np.minimum(after / RISING, 1.0)
    return share**2 * (3.0 - 2.0 * share)
