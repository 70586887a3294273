"""A motion: any time in, poses and points out."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from odeform.geometry.shape import surface_shares
from odeform.model.reduced import ReducedSpace, rotation_of, to_canonical
from odeform.schema import Parameters, Schema
from odeform.types import Floats, Frames, GaussianSplats, Geometry, Perpoint, Points, Pose, Rotations, Times, Vectors

__all__ = ["Motion", "PlacedBasis", "SolveStats", "Trajectory", "place"]


@dataclass(frozen=True)
class SolveStats:
    """How a trajectory came about."""

    solver: str
    steps: int
    evaluations: int
    rejected: int
    status: str
    wall_ms: float
    estimate: Callable[[], float | None] = field(repr=False, compare=False)

    @property
    def solver_error_mm(self) -> float | None:
        """Estimated error of the integration alone, not of the model. Made when first read: it costs about a solve."""
        return self.estimate()


@runtime_checkable
class Trajectory(Protocol):
    """Reduced coordinates over time. What it says of a time never depends on what was asked before."""

    @property
    def stats(self) -> SolveStats: ...

    @property
    def last_good(self) -> float:
        """Seconds up to which the trajectory is sound; later times show the state of that moment."""
        ...

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """(T,) seconds -> (T, 6 + K)."""
        ...


@dataclass(frozen=True, eq=False)
class PlacedBasis:
    """A geometry seen through a basis: points in the scene and canonical (N, 3), values (3 N, K); float32."""

    points: Points
    rest: Points
    values: Float[np.ndarray, "rows modes"]
    reach: Float[np.ndarray, " modes"]
    """Largest displacement of any point by each mode."""
    shares: Perpoint
    """Share of the surface at each point."""


def place(geometry: Geometry, space: ReducedSpace, azimuth: float) -> PlacedBasis:
    """Evaluate the basis on a geometry, which lies in the scene as at rest. Once per geometry and azimuth."""
    rest = to_canonical(geometry.points, space.anchor, azimuth)
    values = space.basis.values(rest)
    points = np.asarray(geometry.points, dtype=np.float32)
    reach = np.sqrt((values**2).sum(axis=1).max(axis=0))
    return PlacedBasis(
        points, rest.astype(np.float32), values.reshape(-1, space.basis.modes), reach, surface_shares(geometry)
    )


@dataclass(frozen=True, eq=False)
class Motion:
    """P(t) = T(t) o D(t)(P0) of one geometry under one set of parameters (paper eq. 4).

    `placed` is the geometry on its way into the basis; `outside` names the parameters beyond their trained range.
    """

    schema: Schema
    parameters: Parameters
    geometry: Geometry
    space: ReducedSpace
    placed: PlacedBasis
    trajectory: Trajectory

    @property
    def stats(self) -> SolveStats:
        return self.trajectory.stats

    @property
    def outside(self) -> tuple[str, ...]:
        return self.schema.outside(self.parameters)

    def extrapolates(self, time: float) -> bool:
        """Whether `time` lies beyond the trained window."""
        return not self.schema.window.start <= time <= self.schema.window.stop + 1e-9

    def _reduced(self, t: float | Times) -> Float[np.ndarray, "times y"]:
        return self.trajectory.reduced(np.atleast_1d(np.asarray(t, dtype=float)))

    def vertices(self, t: float | Times) -> Points | Frames:
        """(N, 3) float32 metres at time `t` in seconds; (T, N, 3) for (T,) times."""
        y = self._reduced(t)
        rotation, shift = self._rotation_shift(y)
        turned = rotation.swapaxes(-1, -2)
        # as what moved since P0: the turn vanishes identically at rest, so that P(0) is P0 to the last bit
        out = self.placed.rest @ (turned - self._to_canonical_axes).astype(np.float32)
        out += self._deformation(y) @ turned.astype(np.float32)
        out += shift[:, None].astype(np.float32)
        out += self.placed.points
        return out[0] if np.ndim(t) == 0 else out

    def pose(self, t: float | Times) -> Pose:
        """T(t), the rigid part: (4, 4) in scene axes, metres; (T, 4, 4) for (T,) times. The identity at rest."""
        rotation, shift = self._rotation_shift(self._reduced(t))
        rotation = rotation @ self._to_canonical_axes
        out = np.zeros((len(rotation), 4, 4))
        out[:, :3, :3] = rotation
        out[:, :3, 3] = shift + self.space.anchor - rotation @ self.space.anchor
        out[:, 3, 3] = 1.0
        return out[0] if np.ndim(t) == 0 else out

    def local(self, t: float | Times) -> Points | Frames:
        """D(t) - id, the deformation alone, in the frame of the body at rest: (N, 3) or (T, N, 3) metres."""
        out = self._deformation(self._reduced(t)) @ self._to_canonical_axes.astype(np.float32)
        return out[0] if np.ndim(t) == 0 else out

    def deformed(self, t: float) -> Points:
        """D(t)(P0), the deformation alone where the body rests: (N, 3) float32 metres. `pose(t)` takes it on."""
        return self.placed.points + self.local(t)

    def gradients(self, t: float) -> Rotations:
        """F(t) = dP/dP0 at each point: (N, 3, 3), from the gradients of the cached basis (one product a frame).

        Off the trained surface the normal derivative is the basis's smooth continuation, not data.
        """
        y = self._reduced(t)
        rotation = self._rotation_shift(y)[0][0]
        canonical = np.eye(3) + self._basis_gradients @ y[0, 6:].astype(np.float32)
        return rotation @ canonical @ self._to_canonical_axes

    @cached_property
    def _basis_gradients(self) -> Floats:
        return self.space.basis.gradients(self.placed.rest)

    def covariances(self, t: float) -> Float[np.ndarray, "points 3 3"]:
        """(N, 3, 3) covariances of splats at time `t`, turned with the rigid part."""
        assert isinstance(self.geometry, GaussianSplats)
        rotation = self.pose(t)[:3, :3]
        return rotation @ self.geometry.covariances @ rotation.T

    def deformation_bound(self, time: float) -> float:
        """No point is displaced locally by more than this at `time`, in metres."""
        y = self._reduced(time)
        return float(np.abs(y[0, 6:]) @ self.placed.reach)

    def deformation_rms(self, times: Times) -> Times:
        """(T,) root-mean-square local displacement of the points in metres."""
        y = self._reduced(times)
        gram = self.placed.values.T @ self.placed.values / len(self.placed.rest)
        return np.sqrt(np.maximum(np.einsum("tk,kl,tl->t", y[:, 6:], gram, y[:, 6:]), 0.0))

    @property
    def _to_canonical_axes(self) -> Rotations:
        return rotation_of(np.zeros(6), self.schema.azimuth(self.parameters))[0].T

    def _rotation_shift(self, y: Floats) -> tuple[Rotations, Vectors]:
        return rotation_of(y[:, :6], self.schema.azimuth(self.parameters))

    def _deformation(self, y: Floats) -> Frames:
        coefficients = y[:, 6:].astype(np.float32)
        # one product for all times; for one time a matrix-vector product at memory speed
        moved = coefficients @ self.placed.values.T if len(y) > 1 else (self.placed.values @ coefficients[0])[None]
        return moved.reshape(len(y), -1, 3)
