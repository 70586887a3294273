"""Ends motions of bodies that gain energy from nothing: deformed too far, they have left what a linear law can say."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from odeform.locks import Lock
from odeform.mechanics.body import Solid
from odeform.mechanics.flat import parts_of
from odeform.models.solved import SolvedTrajectory
from odeform.models.solved_batch import SolvedBatch
from odeform.motion.base import SolveStats
from odeform.motion.reduced_space import POSE, rotation_of
from odeform.surroundings import GRAVITY
from odeform.types import Floats, Times

__all__ = ["LOOKED_AHEAD", "BoundedBatch", "BoundedTrajectory", "EnergyBound"]

LOOKED_AHEAD = 2  # times of the grid beyond what is asked for: up to the next one, and to the one after that

MOST = 1.01  # times what a motion begins with: sound ones stay below 1.001; frames may show half a percent more
STATUS = "it gains energy"

Poses = Callable[[Times], Float[np.ndarray, "*batch times 6"]]
"""Maps (T,) s to poses, in m and rad."""


class EnergyBound:
    """Until when motions that begin in the air have no more energy than they began with; B of them, of one body.

    It is the energy of the rigid motion that is shown, above the floor, from differences on a fixed grid: it does not
    depend on which times are asked for. What is in vibrations would only add to it. A body that has never deformed by
    `deformation`, RMS in m, obeys its law, and is not looked at.
    """

    def __init__(
        self, moving: SolvedTrajectory | SolvedBatch, poses: Poses, solid: Solid, deformation: float, step: float
    ) -> None:
        """`poses` are those at times; `step` s is the grid's."""
        self._moving, self._poses, self._solid, self._step = moving, poses, solid, step
        self._largest = deformation * np.sqrt(solid.mass)  # of amplitudes, root kg m
        self._looked, self._lock = 0, Lock()
        start = self._states(np.zeros(1))[:, 0]
        self._most = MOST * _of_states(start, solid)
        self._deformed = np.zeros(len(start), dtype=bool)  # so far
        self.ends: Float[np.ndarray, " batch"] = np.full(len(start), np.inf)
        """(B,) s: the last moment that is valid; infinite where none is known not to be."""

    def look(self, until: float) -> Float[np.ndarray, " batch"]:
        """Look as far as `until` s; returns `ends`."""
        with self._lock:
            count = math.ceil(until / self._step - 1e-9)
            if count > self._looked:
                self._look_on(count)
            return self.ends

    def _look_on(self, count: int) -> None:
        """Look at the grid's next times, up to that of number `count`."""
        states = self._states(self._step * np.arange(self._looked + 1, count + 1))
        far = np.linalg.norm(states[..., parts_of(states[0])[2]], axis=2) > self._largest
        far = np.logical_or.accumulate(far, axis=1) | self._deformed[:, None]
        if far.any():
            begin = int(far.any(axis=0).argmax())  # nothing is looked at before
            energies = self._energies(self._looked + begin, count + 1)
            wrong = far[:, begin:] & (energies > self._most[:, None])
            first = self._step * (self._looked + begin + wrong.argmax(axis=1))
            self.ends = np.minimum(self.ends, np.where(wrong.any(axis=1), first, np.inf))
        self._deformed, self._looked = far[:, -1], count

    def _states(self, times: Times) -> Float[np.ndarray, "batch times state"]:
        states = self._moving.states(times)
        return states.reshape(-1, *states.shape[-2:])

    def _energies(self, before: int, after: int) -> Float[np.ndarray, "batch times"]:
        """(B, T) m^2/s^2, per mass, at the grid's times between these two."""
        poses = self._poses(self._step * np.arange(before, after + 1))
        poses = poses.reshape(-1, *poses.shape[-2:])
        rotation, shift = (
            part.reshape(*poses.shape[:2], *part.shape[1:]) for part in rotation_of(poses.reshape(-1, POSE), 0.0)
        )
        speed = (shift[:, 2:] - shift[:, :-2]) / (2.0 * self._step)
        turned = rotation[:, :-2].swapaxes(2, 3) @ rotation[:, 2:]
        sines = np.stack(
            [
                turned[..., 2, 1] - turned[..., 1, 2],
                turned[..., 0, 2] - turned[..., 2, 0],
                turned[..., 1, 0] - turned[..., 0, 1],
            ],
            axis=-1,
        )
        spin = sines / (4.0 * self._step)
        return _of_rigid(speed, spin, shift[:, 1:-1, 2], self._solid)


def _of_states(states: Float[np.ndarray, "batch state"], solid: Solid) -> Float[np.ndarray, " batch"]:
    shift, turn, *_, velocity = (states[:, part] for part in parts_of(states))
    spin = np.einsum("bij,bi->bj", turn.reshape(-1, 3, 3), velocity[:, 3:6])
    return _of_rigid(velocity[:, :3], spin, shift[:, 2], solid)


def _of_rigid(speed: Floats, spin: Floats, raised: Floats, solid: Solid) -> Floats:
    """(...) m^2/s^2 of speeds (..., 3) m/s, spins (..., 3) rad/s in axes of the body, and (...) m above its rest."""
    turning = np.einsum("...i,ij,...j->...", spin, solid.inertia / solid.mass, spin)
    return 0.5 * ((speed**2).sum(axis=-1) + turning) + GRAVITY * (solid.height + raised)


class BoundedTrajectory:
    """A solved motion up to the last moment that is valid; later ones show that one."""

    def __init__(
        self,
        inner: SolvedTrajectory,
        poses: Callable[[Floats], Floats],
        solid: Solid,
        deformation: float,
        step: float,
    ) -> None:
        """See `EnergyBound`; `poses` maps states (T, S) to (T, 6)."""
        self._inner = inner
        self._bound = EnergyBound(inner, lambda times: poses(inner.states(times)), solid, deformation, step)

    @property
    def stats(self) -> SolveStats:
        """As of the solution; the status says where energy was gained, as far as is known."""
        stats = self._inner.stats
        return stats if np.isinf(self._bound.ends[0]) else replace(stats, status=STATUS)

    @property
    def last_good(self) -> float:
        """Seconds up to which it is valid, as far as is known."""
        return min(self._inner.last_good, float(self._bound.ends[0]))

    def reduced(self, times: Times) -> Floats:
        """Maps (T,) s to (T, 6 + K)."""
        times = np.asarray(times, dtype=float)
        return self._inner.reduced(np.minimum(times, self._bound.look(float(times.max()))[0]))


class BoundedBatch:
    """Many solved motions, of which those that gain energy are not `ok`: each of them is solved by itself."""

    def __init__(self, inner: SolvedBatch, solid: Solid, deformation: float, step: float) -> None:
        """See `EnergyBound`."""
        self._inner = inner
        self._bound = EnergyBound(inner, lambda times: inner.reduced(times)[..., :POSE], solid, deformation, step)

    @property
    def ok(self) -> Bool[np.ndarray, " batch"]:
        """(B,) whether motions are solved and valid as far as they were asked for."""
        return self._inner.ok & np.isinf(self._bound.ends)

    @property
    def stats(self) -> list[SolveStats]:
        """(B,) as of the solutions."""
        return self._inner.stats

    def reduced(self, times: Times) -> Float[np.ndarray, "batch times y"]:
        """Maps (T,) s to (B, T, 6 + K)."""
        self._bound.look(float(times.max()))
        return self._inner.reduced(times)
