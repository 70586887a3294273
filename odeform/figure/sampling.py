"""The motions of a model under many sets of parameters, as coordinates of one body."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float
from threadpoolctl import threadpool_limits

from odeform.cancellation import check_cancelled
from odeform.errors import InputError
from odeform.figure.body import FigureBody, figure_body
from odeform.figure.sweep import Sweep
from odeform.geometry.parts import subset
from odeform.models.base import Predictor
from odeform.motion.reduced_batch import ReducedBatch
from odeform.motion.reduced_motion import ReducedMotion
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Frames, GaussianSplats, Geometry, Ints, Mesh, Times

__all__ = ["Source"]

TOGETHER = 128  # motions that are solved at once
EXACT = 1e-4  # of the largest difference between bodies at rest: what further modes leave out


@dataclass(frozen=True, eq=False)
class Source:
    """A model whose motions depend on the `sweeps` alone; `fixed` are other parameters."""

    predictor: Predictor
    sweeps: Sequence[Sweep]
    fixed: Mapping[str, Any]
    geometry: Geometry | None = None
    """The shape that moves; None for the trained body, where it rests under each set of parameters."""
    quality: str | SolverSettings = "balanced"
    still: Geometry | None = None
    """What of a scene of splats stands still, in the scene."""

    def values(self, places: Float[np.ndarray, "sets sweeps"]) -> dict[str, Floats]:
        """Maps places on the sliders (S, A), from 0 to 1, to values (S,) by name."""
        return {sweep.name: sweep.values(column) for sweep, column in zip(self.sweeps, places.T, strict=True)}

    def complete(self, place: Float[np.ndarray, " sweeps"]) -> dict[str, Any]:
        """Returns all parameters at a place (A,) on the sliders."""
        values = self.values(place[None])
        return self.predictor.complete({**self._others, **{name: float(value[0]) for name, value in values.items()}})

    @cached_property
    def _others(self) -> dict[str, Any]:
        """All parameters without a slider: a contact is where the body has it, whatever component of a force varies."""
        swept = {sweep.name for sweep in self.sweeps}
        return {name: value for name, value in self.predictor.complete(self.fixed).items() if name not in swept}

    @cached_property
    def middle(self) -> ReducedMotion:
        """The motion in the middle of the sliders; `InputError` for one without reduced coordinates."""
        motion = self._solved(np.full(len(self.sweeps), 0.5), None, self.geometry)
        if not isinstance(motion, ReducedMotion):
            raise InputError(
                f"a figure needs a pose and a basis of deformations; {self.predictor.model} predicts points"
            )
        return motion

    @cached_property
    def sags(self) -> bool:
        """Whether the body at rest depends on the sliders."""
        if self.geometry is not None:
            return False
        ends = [self.predictor.settled(self.complete(place)).points for place in self._corners]
        return any(not np.array_equal(points, ends[0]) for points in ends)

    @property
    def _corners(self) -> Floats:
        count = len(self.sweeps)
        return np.array([[index >> bit & 1 for bit in range(count)] for index in range(1 << count)], dtype=float)

    @cached_property
    def _sagging(self) -> Float[np.ndarray, "extra points 3"]:
        """(E, N, 3) m: fields that add up to the differences between bodies at rest, at the corners of the sliders and
        between them; their mean square over the points is one."""
        points = self.middle.evaluated.points
        if not self.sags:
            return np.zeros((0, *points.shape), dtype=np.float32)
        places = np.concatenate([self._corners, 0.5 + 0.5 * (self._corners - 0.5)])
        bodies = np.stack([self.predictor.settled(self.complete(place)).points - points for place in places])
        _, size, fields = np.linalg.svd(bodies.reshape(len(bodies), -1), full_matrices=False)
        kept = int((size > EXACT * size[0]).sum())
        return (fields[:kept] * np.sqrt(len(points))).reshape(kept, *points.shape).astype(np.float32)

    @cached_property
    def body(self) -> FigureBody:
        """The body at rest in the middle of the sliders; further modes take it to where it rests elsewhere."""
        still = self.still if isinstance(self.still, GaussianSplats) else None
        return figure_body(self.middle, self._sagging, still)

    def coordinates(self, places: Float[np.ndarray, "sets sweeps"], times: Times) -> Float[np.ndarray, "sets times y"]:
        """Computes y (S, T, 6 + K) float32 of `body` at places (S, A) and times (T,) s."""
        out = np.empty((len(places), len(times), len(self.body.scale)), dtype=np.float32)
        # products are small: threads would wait for each other longer than they work
        with threadpool_limits(1, "blas"):
            for at in range(0, len(places), TOGETHER):
                check_cancelled()
                self._solve_into(out[at : at + TOGETHER], places[at : at + TOGETHER], times)
        return out

    def _solve_into(self, out: Floats, places: Float[np.ndarray, "sets sweeps"], times: Times) -> None:
        """Fills `out` (S, T, 6 + K)."""
        until = float(times[-1])
        if self.sags or not self.sweeps:
            motions = (self._solved(place, until, self.geometry) for place in places)
        else:
            motions = self.predictor.solve_batch(
                {**self.fixed, **self.values(places)}, self.quality, until, self.geometry
            )
            if isinstance(motions, ReducedBatch):
                out[:] = motions.coordinates(times)
                return
        for row, motion in zip(out, motions, strict=True):
            self._fill(row, motion, times)

    def vertices(
        self, places: Float[np.ndarray, "sets sweeps"], times: Times, kept: Ints | None = None
    ) -> list[Frames]:
        """Computes S arrays (T, N, 3) of points in metres, as the model has them; of those that are `kept` alone."""
        shape = self.geometry
        if kept is not None and shape is not None and not isinstance(shape, Mesh):
            shape = subset(shape, kept)
        with threadpool_limits(1, "blas"):
            return [self._solved(place, float(times[-1]), shape).vertices(times) for place in places]

    def _fill(self, row: Floats, motion: Any, times: Times) -> None:
        assert isinstance(motion, ReducedMotion)
        modes, extra = motion.evaluated.space.basis.modes, self._sagging
        row[:, : 6 + modes] = motion.coordinates(times)
        apart = motion.evaluated.points - self.middle.evaluated.points
        row[:, 6 + modes :] = np.einsum("eni,ni->e", extra, apart) / len(apart)

    def _solved(self, place: Float[np.ndarray, " sweeps"], until: float | None, shape: Geometry | None) -> Any:
        return self.predictor.solve(shape, self.complete(place), self.quality, until)
