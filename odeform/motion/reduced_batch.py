"""Many motions of a reduced model: their coordinates are computed together, in parts of a bounded size."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from odeform.motion.base import LATEST, Motion, SolveStats
from odeform.motion.batch_plausibility import BatchPlausibility
from odeform.motion.batch_trajectory import BatchTrajectory, Coordinates
from odeform.motion.body import CheckedBody
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.ground import Ground
from odeform.motion.limits import Limits
from odeform.motion.motion_batch import BatchPoses, BatchVertices, MotionBatch
from odeform.motion.plausibility import Sample
from odeform.motion.reduced_motion import as_reduced, moved_points, placements, poses_of
from odeform.motion.reduced_space import POSE
from odeform.schema import Parameters, Window
from odeform.types import Floats, Ints, Times

__all__ = ["BatchPart", "ReducedBatch"]


class BatchPart:
    """Some of the motions of a batch, in their order."""

    def __init__(
        self,
        trajectory: BatchTrajectory,
        body: CheckedBody,
        limits: Limits,
        window: Window,
        azimuths: Times,
        grounds: Sequence[Ground | None],
    ) -> None:
        """`body` is the trained one, by which motions are checked for plausibility, `azimuths` (B,) are in radians;
        `grounds` (B,) are as of `ReducedMotion`."""
        self.trajectory, self.azimuths = trajectory, azimuths
        self._body, self._window = body, window
        self._obstacles = [() if ground is None else ground.obstacles for ground in grounds]
        self.plausibility = BatchPlausibility(
            limits, window, len(azimuths), lambda times: self._sample(times, trajectory.reduced(times))
        )

    def _sample(self, times: Times, y: Coordinates) -> Sample:
        passed = np.tile(self._window.passed(times), len(y))
        sample = self._body.sample(y.reshape(-1, y.shape[-1]), passed)
        if not any(self._obstacles):
            return sample
        each = [
            self._body.sample(one, self._window.passed(times), some).lowest
            for one, some in zip(y, self._obstacles, strict=True)
        ]
        return replace(sample, lowest=np.concatenate(each))

    def reduced(self, times: Times) -> tuple[Coordinates, Bool[np.ndarray, " batch"]]:
        """(B, T, 6 + K) at (T,) seconds of the clock, bounded, and which motions (B,) are valid there."""
        y = self.trajectory.reduced(times)
        valid = self.plausibility.valid(times, self._sample(times, y)) & self.trajectory.ok
        windows = np.tile(self._window.passed(times), len(y))
        return self._body.all.space.bounded(y.reshape(-1, y.shape[-1]), windows).reshape(y.shape), valid


class ReducedBatch(MotionBatch):
    """Motions that are solved in parts. One that is clamped at its last valid moment, or whose solver failed, is asked
    by
    itself: it is as `Predictor.solve` has it."""

    def __init__(
        self,
        sets: Sequence[Parameters],
        one: Callable[[int], Motion],
        window: Window,
        parts: Sequence[BatchPart],
        basis: Callable[[float], EvaluatedBasis],
        grounds: Sequence[Ground | None],
    ) -> None:
        """`basis` evaluates that of the geometry at an azimuth in radians; `grounds` (B,) are as of `ReducedMotion`."""
        super().__init__(sets, one)
        self._grounds = grounds
        self._window, self._parts, self._basis = window, parts, basis

    @property
    def stats(self) -> tuple[SolveStats, ...]:
        """How each motion was computed, (B,)."""
        known = [stats for part in self._parts for stats in part.trajectory.stats]
        ok = np.concatenate([part.trajectory.ok for part in self._parts])

        def stated(index: int) -> SolveStats:
            if not ok[index]:
                return self[index].stats
            return replace(known[index], estimate=lambda: self[index].stats.solver_error_mm)

        return tuple(stated(index) for index in range(len(self)))

    @property
    def status(self) -> tuple[str, ...]:
        """(B,) as `Motion.status`: that of the solver, and from where on a motion is not physically possible."""
        latest = float(self._window.soft_clamped(np.array(LATEST * self._window.stop)))
        good = [part.plausibility.valid_throughout(latest) & part.trajectory.ok for part in self._parts]
        return tuple("ok" if ok else self[index].status for index, ok in enumerate(np.concatenate(good)))

    def vertices(self, t: float | Times) -> BatchVertices:
        """Computes (B, N, 3) float32 metres at time `t` in seconds; (B, T, N, 3) for (T,) times."""
        count = len(self._basis(float(self._parts[0].azimuths[0])).points)

        def move(azimuth: float, y: Coordinates, out: Floats, rows: Ints) -> None:
            evaluated = self._basis(azimuth)
            placed = placements(evaluated.space, y.reshape(-1, y.shape[-1]), azimuth)
            weights, rotations = (each.reshape(*y.shape[:2], *each.shape[1:]) for each in placed)
            for row, *one in zip(rows.tolist(), y, weights, rotations, strict=True):
                # as of a single motion: products of more rows round differently
                out[row] = moved_points(evaluated, *one)
                if (ground := self._grounds[row]) is not None:
                    ground.keep_out(out[row], evaluated.sides)

        return self._filled(t, (count, 3), np.float32, move, lambda motion, times: motion.vertices(times))

    def coordinates(self, times: Times) -> Coordinates:
        """Computes (B, T, 6 + K) in metres and radians at (T,) seconds, as of `ReducedMotion.coordinates`."""

        def take(_: float, y: Coordinates, out: Floats, rows: Ints) -> None:
            out[rows] = y

        size = POSE + self._basis(float(self._parts[0].azimuths[0])).space.basis.modes
        return self._filled(times, (size,), float, take, lambda motion, at: as_reduced(motion).coordinates(at))

    def pose(self, t: float | Times) -> BatchPoses:
        """Returns the rigid parts, as of `Motion.pose`: (B, 4, 4), or (B, T, 4, 4) for (T,) seconds."""

        def place(azimuth: float, y: Coordinates, out: Floats, rows: Ints) -> None:
            space = self._basis(azimuth).space
            out[rows] = poses_of(space, y.reshape(-1, y.shape[-1]), azimuth).reshape(len(y), -1, 4, 4)

        return self._filled(t, (4, 4), float, place, lambda motion, times: motion.pose(times))

    def _filled(
        self,
        t: float | Times,
        shape: tuple[int, ...],
        dtype: type,
        together: Callable[[float, Coordinates, Floats, Ints], None],
        alone: Callable[[Motion, Times], Floats],
    ) -> Floats:
        """(B, *shape), or (B, T, *shape) for (T,) times: of all motions of a part with one azimuth `together`, into
        those rows of an array, or of a motion `alone`."""
        times = np.atleast_1d(np.asarray(t, dtype=float))
        clock = self._window.soft_clamped(times)
        out, first = np.empty((len(self), len(times), *shape), dtype), 0
        for part in self._parts:
            y, valid = part.reduced(clock)
            for azimuth in np.unique(part.azimuths[valid]):
                members = np.flatnonzero(valid & (part.azimuths == azimuth))
                together(float(azimuth), y[members], out, first + members)
            for index in np.flatnonzero(~valid):
                out[first + index] = alone(self[int(first + index)], times)
            first += len(y)
        return out[:, 0] if np.ndim(t) == 0 else out
