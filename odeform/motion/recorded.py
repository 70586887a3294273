"""A simulated or measured motion, with the interface that viewers use for predicted ones."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from odeform.geometry.rigid import best_rigid, rotation_from_vector, unwrapped_vectors
from odeform.geometry.shape import surface_weights
from odeform.loads.registry import first_body, meets_twin
from odeform.motion.base import SolveStats, checked_times
from odeform.schema import OBJECT, Parameters, Schema
from odeform.types import Floats, Frames, Mesh, MotionSequence, Perpoint, Points, Pose, Times

__all__ = ["RecordedMotion"]

STILL = 2e-3  # m/s, RMS over the surface: twice the speed, over the mass, at which simulations end
STILL_FOR = 0.05  # s


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """A sequence at any time: cubic between its frames, held after the last one: rightly, if the body rests."""

    schema: Schema
    sequence: MotionSequence
    fixed: Mapping[str, float] = field(default_factory=dict)
    """Physical quantities that are constant in its data set; they may be parameters of a model."""

    @cached_property
    def geometry(self) -> Mesh:
        """The mesh at rest."""
        return self.sequence.rest

    @property
    def parameters(self) -> Parameters:
        """The quantities that vary in the data set, by name."""
        return self.sequence.parameters

    @property
    def setting(self) -> Parameters:
        """Varied and fixed quantities together."""
        return {**self.fixed, **self.parameters}

    @property
    def unknown(self) -> tuple[str, ...]:
        """Names of the parameters that are not known, as in a motion that was captured."""
        return tuple(p.name for p in self.schema.learned if p.name not in self.setting)

    @property
    def rate(self) -> float:
        """Frames per second."""
        return 1.0 / float(self.sequence.times[1] - self.sequence.times[0])

    @property
    def end(self) -> float:
        """Seconds of the last frame."""
        return float(self.sequence.times[-1])

    @property
    def stats(self) -> SolveStats:
        """The frame rate in place of a solver; its error counts as zero."""
        return SolveStats(f"recorded, {self.rate:.4g} frames per second", 0, 0, 0, "ok", 0.0, lambda: 0.0)

    @property
    def outside(self) -> tuple[str, ...]:
        """Empty: a recording has no trained range."""
        return ()

    @cached_property
    def rests(self) -> bool:
        """Whether the body lies still at the end: then the last frame is right at all later times, too."""
        times, frames = self.sequence.times, self.sequence.vertices
        first = int(np.searchsorted(times, self.end - STILL_FOR + 1e-9, side="right")) - 1
        if first < 0:
            return False
        square = ((frames[first:].astype(float) - frames[-1]) ** 2).sum(axis=2) @ self.sequence.weights
        moved = np.sqrt(square.max() / self.sequence.weights.sum())
        return bool(moved < STILL * (self.end - times[first]))

    def extrapolates(self, time: float) -> bool:
        """Whether the recording ended before `time`, while the body still moved."""
        return time > self.end + 1e-9 and not self.rests

    def vertices(self, t: float | Times) -> Points | Frames:
        """Computes (N, 3) float32 metres at time `t` in seconds; (T, N, 3) for (T,) times."""
        out = self._splines[0](np.clip(checked_times(t), 0.0, self.end)).astype(np.float32)
        return out[0] if np.ndim(t) == 0 else out

    def pose(self, t: float | Times) -> Pose:
        """The best rigid motion from the rest, of two bodies that of the first: (4, 4) in scene axes, metres; (T, 4, 4)
        for (T,) times."""
        turn, shift = np.split(self._splines[1](np.clip(checked_times(t), 0.0, self.end)), 2, axis=1)
        out = np.zeros((len(turn), 4, 4))
        out[:, :3, :3] = rotation_from_vector(turn)
        out[:, :3, 3] = shift + self._centre - out[:, :3, :3] @ self._centre
        out[:, 3, 3] = 1.0
        return out[0] if np.ndim(t) == 0 else out

    def placement(self, t: float | Times) -> Pose:
        """Where `deformed(t)` is put: the pose, or of two bodies the identity."""
        pose = self.pose(t)
        return np.broadcast_to(np.eye(4), pose.shape) if meets_twin(self.schema.scene) else pose

    def deformed(self, t: float) -> Points:
        """The deformation without the pose: (N, 3) float32 metres; `placement(t)` moves it to `vertices(t)`."""
        pose = self.placement(t)
        return ((self.vertices(t) - pose[:3, 3]) @ pose[:3, :3]).astype(np.float32)

    def deformation_bound(self, time: float) -> float:
        """Returns the largest local displacement of any point at `time`, in metres."""
        return float(np.linalg.norm(self.deformed(time) - self.sequence.vertices[0], axis=1).max())

    def deformation_rms(self, times: Times) -> Times:
        """(T,) root-mean-square local displacement over the surface in metres."""
        frames, rest, weights = self.vertices(times), self.sequence.vertices[0], surface_weights(self.geometry)
        count = self._first.stop
        bodies, squares = (slice(first, first + count) for first in range(0, len(rest), count)), 0.0
        for body in bodies:
            turns, shifts = best_rigid(rest[body], frames[:, body], weights[body] / weights[body].sum())
            middle = weights[body] @ rest[body].astype(float) / weights[body].sum()
            back = np.einsum("tni,tij->tnj", frames[:, body] - (middle + shifts)[:, None], turns)
            squares = squares + ((back + middle - rest[body]) ** 2).sum(axis=2) @ weights[body]
        return np.sqrt(np.asarray(squares))

    def of(self, parameters: Parameters) -> bool:
        """Whether this may be the motion under these parameters, to the resolution of a slider."""
        if parameters.get(OBJECT) != self.parameters.get(OBJECT):
            return False
        varied = [p for p in self.schema.parameters if p.name in self.parameters]
        fixed = {
            name: value for name, value in self.fixed.items() if name in parameters and name not in self.parameters
        }
        return all(
            abs(p.normalise(parameters[p.name]) - p.normalise(self.parameters[p.name])) < 2e-3 for p in varied
        ) and all(np.isclose(parameters[name], value, rtol=1e-3) for name, value in fixed.items())

    @cached_property
    def _centre(self) -> Floats:
        return self._weights @ self.sequence.vertices[0, self._first].astype(float)

    @cached_property
    def _first(self) -> slice:
        """The vertices of the body whose pose is known."""
        return first_body(self.schema.scene, len(self.sequence.weights))

    @cached_property
    def _weights(self) -> Perpoint:
        weights = self.sequence.weights[self._first]
        return weights / weights.sum()

    @cached_property
    def _splines(self) -> tuple[CubicSpline, CubicSpline]:
        """Splines of the vertices (N, 3), and of rotation vector and shift of the centre (6,).

        Linear interpolation would cut 1 mm off an impact at 120 frames per second, more than the error of good models.
        """
        times, vertices = self.sequence.times, self.sequence.vertices
        rotations, shifts = best_rigid(vertices[0, self._first], vertices[:, self._first], self._weights)
        poses = np.concatenate([unwrapped_vectors(rotations), shifts], axis=1)
        return CubicSpline(times, vertices.astype(float)), CubicSpline(times, poses)
