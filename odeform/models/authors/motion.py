"""The motion of a network that predicts whole shapes on a grid of frames."""

from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from odeform.errors import InputError
from odeform.geometry.shape import surface_weights
from odeform.motion.base import Motion, SolveStats, checked_times
from odeform.schema import Parameters, Schema
from odeform.types import Frames, Geometry, Matrices, Points, Pose, Times

__all__ = ["FrameMotion"]

CHUNK = 1 << 14  # coordinates that are worked on at once: they stay in the cache


class FrameMotion(Motion):
    """Offsets of the body and displacements of its points at frames; cubic between them, held before and after."""

    def __init__(
        self,
        schema: Schema,
        parameters: Parameters,
        geometry: Geometry,
        times: Times,
        offsets: Float[np.ndarray, "times 3"],
        displacements: Frames,
        stats: SolveStats,
    ) -> None:
        """`offsets` (T, 3) and `displacements` (T, N, 3) in metres at (T,) `times` in seconds."""
        self.schema, self.parameters, self.geometry = schema, parameters, geometry
        self._points = np.asarray(geometry.points, dtype=np.float32)
        self._times, self._stats = times, stats
        self._offsets = CubicSpline(times, offsets)
        self._displacements = displacements.reshape(len(times), -1).astype(np.float32)
        # a spline through frames is linear in them: these are the weights of the frames
        self._weights = CubicSpline(times, np.eye(len(times)))

    @property
    def stats(self) -> SolveStats:
        return self._stats

    @property
    def last_good(self) -> float:
        return float("inf")

    def vertices(self, t: float | Times) -> Points | Frames:
        times = self._clamped(t)
        out = self._points + self._local(times) + self._offsets(times)[:, None].astype(np.float32)
        return out[0] if np.ndim(t) == 0 else out

    def pose(self, t: float | Times) -> Pose:
        times = self._clamped(t)
        out = np.tile(np.eye(4), (len(times), 1, 1))
        out[:, :3, 3] = self._offsets(times)
        return out[0] if np.ndim(t) == 0 else out

    def local(self, t: float | Times) -> Points | Frames:
        out = self._local(self._clamped(t))
        return out[0] if np.ndim(t) == 0 else out

    def deformed(self, t: float) -> Points:
        return self._points + self.local(t)

    def covariances(self, t: float) -> Matrices:
        raise InputError("released: cannot deform splats; expected a mesh or points")

    def deformed_covariances(self, t: float) -> Matrices:
        return self.covariances(t)

    def deformation_bound(self, time: float) -> float:
        return float(np.linalg.norm(self.local(time), axis=1).max())

    def deformation_rms(self, times: Times) -> Times:
        weights = self._weights(self._clamped(times))
        return np.sqrt(np.maximum(np.einsum("tk,kl,tl->t", weights, self._gram, weights), 0.0))

    def _clamped(self, t: float | Times) -> Times:
        times = self.schema.window.soft_clamped(checked_times(t))
        return np.clip(times, self._times[0], self._times[-1])

    def _local(self, times: Times) -> Frames:
        """(M,) clamped seconds -> (M, N, 3) metres, float32."""
        return (self._weights(times).astype(np.float32) @ self._displacements).reshape(len(times), -1, 3)

    @cached_property
    def _gram(self) -> Float[np.ndarray, "times times"]:
        """Mean products of the frames' displacements over the surface, m^2."""
        weights = np.repeat(surface_weights(self.geometry), 3).astype(np.float32)
        out = np.zeros((len(self._times), len(self._times)))
        for at in range(0, len(weights), CHUNK):
            part = self._displacements[:, at : at + CHUNK]
            out += (part * weights[at : at + CHUNK]) @ part.T
        return out
