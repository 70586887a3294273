"""The motion of a model that predicts where each point goes: pose and deformation follow from its points.

In the scene's canonical frame (turned by minus the azimuth about the vertical axis through the anchor) a motion is

    P(t) = P0 + Rz(a) [ m(t) + u(x, t) ],   x = Rz(-a) (P0 - anchor),   m(0) = u(x, 0) = 0,

with the mean motion m (3) of the training data, and a model's displacements u from it. The pose is the best rigid
motion of some points of the trained body, and is the same for any shape.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from odeform.errors import InputError
from odeform.geometry.rigid import best_rigid, rotation_z
from odeform.geometry.shape import surface_weights
from odeform.motion.base import Motion, SolveStats
from odeform.motion.plausibility import PlausibilityCheck, Sample
from odeform.motion.reduced_space import to_canonical
from odeform.motion.validity import UNKNOWN, Validity
from odeform.schema import Parameters, Schema, soft_clip
from odeform.types import Frames, Geometry, Matrices, Points, Pose, Times, Vector, Vectors

__all__ = ["MeanMotion", "PointFrame", "PointMotion", "PointTrajectory", "Probes", "evaluate_probes"]

PROBES = 96
MARGIN = 1.25  # times the largest trained displacement, up to which predictions are unchanged


@runtime_checkable
class PointTrajectory(Protocol):
    """Displacements of some points from the mean motion. The result for a time never depends on earlier requests."""

    def stats(self) -> SolveStats:
        """How the trajectory was computed; it is computed first if it has not been."""
        ...

    def displacements(self, times: Times) -> Frames:
        """Maps (T,) seconds to (T, N, 3) metres in canonical axes; zero at time 0."""
        ...


@dataclass(frozen=True, eq=False)
class MeanMotion:
    """The average motion: `shifts` (T, 3) metres, canonical, at `times` (T,) s; cubic in between, held afterwards."""

    times: Times
    shifts: Float[np.ndarray, "times 3"]

    def __post_init__(self) -> None:
        even = self.times.ndim == 1 and self.shifts.shape == (len(self.times), 3) and len(self.times) > 1
        if not even or not (np.diff(self.times) > 0.0).all() or not np.isfinite(self.shifts).all():
            raise ValueError("mean: expected times that increase, and as many finite shifts")

    def at(self, times: Times) -> Float[np.ndarray, "asked 3"]:
        """(T,) seconds -> (T, 3) metres; zero at the start."""
        return self._spline(np.clip(times, self.times[0], self.times[-1]))

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(self.times, self.shifts)


@dataclass(frozen=True)
class PointFrame:
    """The units of a point model: points relative to the `anchor`, in units of the body's radius of gyration.

    `reach` is the largest distance of the trained body from the anchor, `largest` the largest displacement in the
    training data; `scale` is the root mean square over coordinates of displacements from the mean motion, `part_scale`
    that of displacements less their mean over the body. All metres.
    """

    anchor: tuple[float, float, float]
    gyration_radius: float
    reach: float
    largest: float
    scale: float
    part_scale: float

    def inputs(self, rest: Vectors) -> Points:
        """Maps (N, 3) metres relative to the anchor to units of the radius of gyration, float32.

        Points farther away than one and a half times `reach` are pulled in along their ray, to at most twice `reach`,
        so that inputs of networks are bounded.
        """
        away = np.maximum(np.linalg.norm(rest, axis=-1, keepdims=True), np.finfo(float).tiny)
        near = soft_clip(away, 1.5 * self.reach, 0.5 * self.reach)
        return (rest * (near / away) / self.gyration_radius).astype(np.float32)

    def bounded(self, displacements: Frames) -> Frames:
        """Bounds displacements: bit-exact up to a quarter above the largest trained displacement; soft-clipped
        beyond."""
        limit = MARGIN * self.largest
        size = np.linalg.norm(displacements, axis=-1, keepdims=True)
        if not (size > limit).any():
            return displacements
        return np.where(
            size > limit, displacements * (soft_clip(size, limit, limit - self.largest) / size), displacements
        )


@dataclass(frozen=True, eq=False)
class Probes:
    """`points` (M, 3) of a body, canonical, metres, and their `areas` (M,), fractions of its surface."""

    points: Float[np.ndarray, "probes 3"]
    areas: Float[np.ndarray, " probes"]


def evaluate_probes(rest: Geometry, anchor: Vector, count: int = PROBES) -> Probes:
    """Chooses vertices spread over the body, each the farthest from the ones before (Gonzalez 1985)."""
    points = to_canonical(rest.points, anchor, 0.0)
    chosen, distance = [0], np.linalg.norm(points - points[0], axis=1)
    nearest = np.zeros(len(points), dtype=int)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(distance.argmax()))
        other = np.linalg.norm(points - points[chosen[-1]], axis=1)
        nearest[other < distance] = len(chosen) - 1
        distance = np.minimum(distance, other)
    return Probes(points[chosen], np.bincount(nearest, surface_weights(rest), minlength=len(chosen)))


class PointMotion(Motion):
    """P0 + m + u: `shape` moves the points of the geometry, `body` the probes that determine the pose."""

    def __init__(
        self,
        schema: Schema,
        parameters: Parameters,
        geometry: Geometry,
        frame: PointFrame,
        mean: MeanMotion,
        probes: Probes,
        shape: PointTrajectory,
        body: PointTrajectory,
        validity: Validity = UNKNOWN,
    ) -> None:
        self.schema, self.parameters, self.geometry = schema, parameters, geometry
        self._frame, self._mean, self._probes, self._shape, self._body = frame, mean, probes, shape, body
        self.validity = validity
        self._points = np.asarray(geometry.points, dtype=np.float32)
        self._turn = rotation_z(schema.azimuth(parameters))
        self._last: tuple[float, Points] | None = None

    @property
    def stats(self) -> SolveStats:
        return self._shape.stats()

    @property
    def last_good(self) -> float:
        return float("inf")

    def vertices(self, t: float | Times) -> Points | Frames:
        last = self._last  # once: another thread may replace it
        if np.ndim(t) == 0 and last is not None and last[0] == t:
            return last[1].copy()
        moved = self._displaced(self._shape, t)
        out = self._points + moved @ self._turn.T.astype(np.float32)
        if np.ndim(t) == 0:
            self._last = (float(np.asarray(t)), out[0])
            return out[0].copy()
        return out

    def pose(self, t: float | Times) -> Pose:
        moved, (points, areas) = self._displaced(self._body, t), (self._probes.points, self._probes.areas)
        rotation, shift = best_rigid(points, points + moved, areas)
        centre = areas @ points
        turned = self._turn @ rotation @ self._turn.T
        anchor = np.array(self._frame.anchor)
        out = np.zeros((len(moved), 4, 4))
        out[:, :3, :3] = turned
        out[:, :3, 3] = anchor - turned @ (anchor + self._turn @ centre) + (centre + shift) @ self._turn.T
        out[:, 3, 3] = 1.0
        out[~moved.any(axis=(1, 2))] = np.eye(4)
        return out[0] if np.ndim(t) == 0 else out

    def local(self, t: float | Times) -> Points | Frames:
        pose, moved = self.pose(t).reshape(-1, 4, 4), self.vertices(t).reshape(-1, *self._points.shape)
        back = (moved - pose[:, None, :3, 3]) @ pose[:, :3, :3]
        out = (back - self._points).astype(np.float32)
        return out[0] if np.ndim(t) == 0 else out

    def deformed(self, t: float) -> Points:
        return self._points + self.local(t)

    def covariances(self, t: float) -> Matrices:
        raise InputError("point models cannot deform splats; expected a mesh or points")

    def deformed_covariances(self, t: float) -> Matrices:
        return self.covariances(t)

    def deformation_bound(self, time: float) -> float:
        return float(np.linalg.norm(self.local(time), axis=1).max())

    def deformation_rms(self, times: Times) -> Times:
        moved, (points, areas) = self._displaced(self._body, times), (self._probes.points, self._probes.areas)
        rotation, shift = best_rigid(points, points + moved, areas)
        centre = areas @ points
        back = np.einsum("tji,tnj->tni", rotation, points + moved - (centre + shift)[:, None])
        return np.sqrt(((back - (points - centre)) ** 2).sum(axis=2) @ areas)

    def _displaced(self, trajectory: PointTrajectory, t: float | Times) -> Frames:
        """(T, N, 3) metres, canonical, float32; (1, N, 3) for a single time."""
        return _predicted(trajectory, self._mean, self._frame, self._clock(t))

    def _make_check(self) -> PlausibilityCheck | None:
        if self.validity is UNKNOWN:
            return None
        body, probes, mean, frame = self._body, self._probes, self._mean, self._frame

        # without this motion: what refers to itself stays until Python looks for cycles, and motions are large
        def sample(times: Times) -> Sample:
            """Samples the probes. Deformations are bounded by construction."""
            moved = probes.points + _predicted(body, mean, frame, times) + np.array(frame.anchor)
            return Sample(moved[..., 2].min(axis=1), np.zeros(len(times)), moved.mean(axis=1))

        return PlausibilityCheck(self.validity.limits, self.schema.window, sample)


def _predicted(trajectory: PointTrajectory, mean: MeanMotion, frame: PointFrame, times: Times) -> Frames:
    moved = trajectory.displacements(times) + mean.at(times)[:, None]
    return frame.bounded(moved).astype(np.float32)
