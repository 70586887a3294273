"""The motion of a reduced model: pose and coefficients at any time, and the points that they move."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.motion.base import Motion, SolveStats
from odeform.motion.body import CheckedBody
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.ground import Ground
from odeform.motion.local_frames import Axes, gradients, moved_covariances
from odeform.motion.plausibility import PlausibilityCheck, Sample
from odeform.motion.reduced_space import ReducedSpace, rotation_of
from odeform.motion.threads import thread_map
from odeform.motion.trajectory import Trajectory
from odeform.motion.validity import UNKNOWN, Validity
from odeform.schema import Parameters, Schema
from odeform.types import Floats, Frames, GaussianSplats, Geometry, Matrices, Points, Pose, Rotations, Times, Vectors

__all__ = ["ReducedMotion", "as_reduced", "moved_points", "placements", "poses_of"]

SEVERAL = 4  # points that are rotated as one: products with three rows leave most vector lanes unused
BLOCK = 1 << 16  # points times frames that are worked on at once: they stay in the cache until they are rotated
MANY = 16  # from this number on, blocks are shared among the cores


@dataclass(frozen=True, eq=False)
class ReducedMotion(Motion):
    """T(t) and D(t) separately: a pose, and coefficients of a basis. `evaluated` is the basis on the geometry.

    `body` is the trained body, whose motion is checked for plausibility: it is the same for every shape.
    """

    schema: Schema
    parameters: Parameters
    geometry: Geometry
    space: ReducedSpace
    evaluated: EvaluatedBasis
    trajectory: Trajectory
    validity: Validity = UNKNOWN
    body: CheckedBody | None = None
    ground: Ground | None = None
    """What points that would be inside of it lie on. None: a motion is as its coordinates say."""

    def _make_check(self) -> PlausibilityCheck | None:
        body, trajectory, window = self.body, self.trajectory, self.schema.window
        obstacles = () if self.ground is None else self.ground.obstacles
        if body is None:
            return None

        # without this motion: what refers to itself stays until Python looks for cycles, and motions are large
        def sample(times: Times) -> Sample:
            return body.sample(trajectory.reduced(times), window.passed(times), obstacles)

        name = " or ".join(dict.fromkeys(obstacle.name for obstacle in obstacles))
        return PlausibilityCheck(self.validity.limits, window, sample, name)

    @property
    def stats(self) -> SolveStats:
        return self.trajectory.stats

    @property
    def last_good(self) -> float:
        return self.trajectory.last_good

    def _reduced(self, t: float | Times) -> Float[np.ndarray, "times y"]:
        times = self._clock(t)
        if not len(times):
            return self._reduced(0.0)[:0]
        return self.space.bounded(self.trajectory.reduced(times), self.schema.window.passed(times))

    def coordinates(self, t: float | Times) -> Float[np.ndarray, "times body_y"]:
        """Computes (T, 6 + K) in metres and radians, double precision: pose and deformation at (T,) seconds, or at
        one."""
        return self._reduced(t)

    def vertices(self, t: float | Times) -> Points | Frames:
        y = self._reduced(t)
        out = moved_points(self.evaluated, y, *placements(self.space, y, self.schema.azimuth(self.parameters)))
        if self.ground is not None:
            self.ground.keep_out(out, self.evaluated.sides)
        return out[0] if np.ndim(t) == 0 else out

    def pose(self, t: float | Times) -> Pose:
        out = poses_of(self.space, self._reduced(t), self.schema.azimuth(self.parameters))
        return out[0] if np.ndim(t) == 0 else out

    def local(self, t: float | Times) -> Points | Frames:
        y, azimuth = self._reduced(t), self.schema.azimuth(self.parameters)
        out = self._deformation(y) @ self._to_canonical_axes.astype(np.float32)
        if self.ground is not None:
            evaluated, poses = self.evaluated, poses_of(self.space, y, azimuth)
            self.ground.keep_posed_out(evaluated.points, out, poses, evaluated.sides)
        return out[0] if np.ndim(t) == 0 else out

    def deformed(self, t: float) -> Points:
        return self.evaluated.points + self.local(t)

    def gradients(self, t: float) -> Matrices:
        """Returns F(t) = dP/dP0 at each point: (N, 3, 3), float32, with singular values within `local_frames.BOUND`.

        Data on a surface determine the tangential part alone: the unit normal there is mapped to that of the deformed
        surface, and a point off the surface has the normal of the nearest point on it.
        """
        y = self._reduced(t)
        carried = self._carried_axes(y, self._rotation_shift(y)[0][0])
        return gradients(_turned(self.evaluated.local_frames.rest, self._to_scene_axes), carried)

    def rotations(self, t: float) -> Matrices:
        """Computes (N, 3, 3) the rotation nearest to F(t) at each point: its polar factor."""
        u, _, vt = np.linalg.svd(self.gradients(t))
        u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
        return u @ vt

    def covariances(self, t: float) -> Matrices:
        y = self._reduced(t)
        return self._moved_covariances(y, self._rotation_shift(y)[0][0])

    def deformed_covariances(self, t: float) -> Matrices:
        return self._moved_covariances(self._reduced(t), self._to_scene_axes)

    def deformation_bound(self, time: float) -> float:
        y = self._reduced(time)
        return float(np.abs(y[0, 6:]) @ self.evaluated.reach)

    def deformation_rms(self, times: Times) -> Times:
        y = self._reduced(times)
        return np.sqrt(np.maximum(np.einsum("tk,kl,tl->t", y[:, 6:], self.evaluated.gram, y[:, 6:]), 0.0))

    @property
    def _to_scene_axes(self) -> Rotations:
        return rotation_of(np.zeros(6), self.schema.azimuth(self.parameters))[0]

    @property
    def _to_canonical_axes(self) -> Rotations:
        return self._to_scene_axes.T

    def _rotation_shift(self, y: Floats) -> tuple[Rotations, Vectors]:
        return rotation_of(y[:, :6], self.schema.azimuth(self.parameters))

    def _deformation(self, y: Floats) -> Frames:
        """(T, N, 3) canonical displacements, by one product for all times."""
        return (y[:, 6:].astype(np.float32) @ self.evaluated.values).reshape(len(y), len(self.evaluated.points), 3)

    def _carried_axes(self, y: Floats, turn: Rotations) -> Axes:
        """The local frames under the deformation of `y` (1, 6 + K), rotated from canonical axes by `turn` (3, 3)."""
        return _turned(self.evaluated.local_frames.carried(y[0, 6:]), turn)

    def _moved_covariances(self, y: Floats, turn: Rotations) -> Matrices:
        assert isinstance(self.geometry, GaussianSplats)
        if y[0, 6:].any():
            return moved_covariances(self.evaluated.covariances, self._carried_axes(y, turn))
        # a rigid motion rotates the given covariances: at rest they are unchanged
        rotation = turn @ self._to_canonical_axes
        flat = self.geometry.covariances.reshape(-1, 9) @ np.kron(rotation, rotation).T
        return flat.reshape(-1, 3, 3).astype(np.float32)


def as_reduced(motion: Motion) -> ReducedMotion:
    """The same motion, as one of reduced coordinates; `InputError` where it is of another kind."""
    if not isinstance(motion, ReducedMotion):
        raise InputError(f"expected a motion of reduced coordinates, got {type(motion).__name__}")
    return motion


def placements(space: ReducedSpace, y: Floats, azimuth: float) -> tuple[Floats, Rotations]:
    """Weights (T, 4 + K) of `EvaluatedBasis.rows`, which deform a body and shift it in its own axes, and rotations
    (T, 3, 3) that follow, for rows; both float32. Of coordinates `y` (T, 6 + K) at an azimuth in radians."""
    rotation, shift = rotation_of(y[:, :6], azimuth)
    ahead = np.einsum("ti,tij->tj", shift + space.anchor, rotation)
    weights = np.concatenate([ahead, np.ones((len(y), 1)), y[:, 6:]], axis=1).astype(np.float32)
    return weights, rotation.swapaxes(-1, -2).astype(np.float32)


def moved_points(evaluated: EvaluatedBasis, y: Floats, weights: Floats, rotations: Rotations) -> Frames:
    """Computes (T, N, 3) float32 metres: the points of a geometry under coordinates `y` (T, 6 + K), from their
    `placements`."""
    count = len(evaluated.points)
    if not len(y):
        return np.empty((0, count, 3), dtype=np.float32)
    out = np.empty((len(y), 3 * count), dtype=np.float32)
    size = max(BLOCK // len(y) // SEVERAL, 1) * SEVERAL

    def fill(begin: int) -> None:
        columns = slice(3 * begin, 3 * (begin + size))
        # one product for all times
        _rotate(weights @ evaluated.rows[:, columns], rotations, out[:, columns])

    begins = range(0, count, size)
    if len(begins) >= MANY:
        thread_map(fill, begins)
    else:
        for begin in begins:
            fill(begin)
    out = out.reshape(len(y), count, 3)
    # P(0) is bit-exactly P0
    out[~y.any(axis=1)] = evaluated.points
    return out


def poses_of(space: ReducedSpace, y: Floats, azimuth: float) -> Pose:
    """Computes (T, 4, 4) rigid parts in scene axes, metres, of coordinates `y` (T, 6 + K) at an azimuth in radians."""
    rotation, shift = rotation_of(y[:, :6], azimuth)
    rotation = rotation @ rotation_of(np.zeros(6), azimuth)[0].T
    out = np.zeros((len(rotation), 4, 4))
    out[:, :3, :3] = rotation
    out[:, :3, 3] = shift + space.anchor - rotation @ space.anchor
    out[:, 3, 3] = 1.0
    return out


def _turned(axes: Axes, rotation: Rotations) -> Axes:
    return rotation.astype(np.float32) @ axes


def _rotate(bodies: Floats, rotations: Rotations, out: Floats) -> None:
    """`out` (T, 3 N): each row of `bodies` (T, 3 N) times its matrix of `rotations` (T, 3, 3), point by point."""
    rows, size = len(bodies), 3 * SEVERAL
    whole = bodies.shape[1] // size * size
    together = np.einsum("ab,tij->taibj", np.eye(SEVERAL, dtype=np.float32), rotations).reshape(rows, size, size)
    np.matmul(bodies[:, :whole].reshape(rows, -1, size), together, out=out[:, :whole].reshape(rows, -1, size))
    if whole < bodies.shape[1]:
        np.matmul(bodies[:, whole:].reshape(rows, -1, 3), rotations, out=out[:, whole:].reshape(rows, -1, 3))
