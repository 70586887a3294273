"""What was observed of a pushed body, compared with predicted surfaces: points that are known, or clouds."""

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from odeform.errors import InputError
from odeform.identification.pushed.state import POSE, Camera
from odeform.types import Faces, Floats, Frames, Ints, Times

__all__ = ["Cloud", "Evidence", "Known", "Residuals"]


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of each frame in mm, their derivatives, and how errors of the model act on them."""

    values: list[Floats]
    """T of (R,) mm: observed minus predicted."""
    slopes: list[Floats]
    """T of (F + C, R) mm: how the prediction moves along each step, then how the observation moves against the camera's
    6 unknowns (shift in m, turn in rad about the middle of the first surface), if it has any."""
    causes: list[Floats]
    """T of (R, 6): the residual of a body displaced by 1 mm along or about each axis."""


@runtime_checkable
class Evidence(Protocol):
    """An observation of T frames."""

    @property
    def times(self) -> Times:
        """(T,) s, of the observations."""
        ...

    @property
    def noise_mm(self) -> float:
        """Standard deviation of each coordinate."""
        ...

    @property
    def camera_free(self) -> bool:
        """Whether it is not known from where the body is seen."""
        ...

    def compared(self, surface: Frames, slopes: Floats, camera: Camera) -> Residuals:
        """Compares predicted surfaces (T, S, 3) m and their slopes (F, T, S, 3) m."""
        ...

    def at(self, kept: Bool[np.ndarray, " times"]) -> "Evidence":
        """The observation of some of the frames."""
        ...


def _causes(points: Floats, lever: float) -> Floats:
    """(N, 3) m -> (N, 3, 6): displacements by a shift and by a turn of 1 mm at `lever` m from the centre."""
    arms = points - points.mean(axis=0)
    turns = np.cross(np.eye(3)[None], arms[:, None]) / lever
    shifts = np.broadcast_to(np.eye(3), (len(points), 3, 3))
    return np.concatenate([shifts, turns.transpose(0, 2, 1).astype(float)], axis=2)


def _lever(surface: Floats) -> float:
    return float(np.sqrt(((surface - surface.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _check(times: Times, frames: list[Floats], noise_mm: float) -> None:
    if not len(times) or len(frames) != len(times) or any(len(frame) == 0 for frame in frames):
        raise InputError("observation: expected at least one time, and points at each of them")
    if not (np.isfinite(times).all() and all(np.isfinite(frame).all() for frame in frames)):
        raise InputError("observation: expected finite points and times")
    if times.min() < 0.0 or not noise_mm > 0.0:
        raise InputError("observation: expected times of at least 0 and positive noise")


@dataclass(frozen=True, eq=False)
class Known:
    """Points whose places on the surface are known: `positions` (T, N, 3) m of points of the faces `face` (N,), at
    `barycentric` (N, 3)."""

    times: Times
    positions: Frames
    faces: Faces
    face: Ints
    barycentric: Float[np.ndarray, "points 3"]
    noise_mm: float
    camera_free: bool = False

    def __post_init__(self) -> None:
        _check(self.times, list(self.positions), self.noise_mm)

    def at(self, kept: Bool[np.ndarray, " times"]) -> "Known":
        """The observation of some of the frames."""
        return replace(self, times=self.times[kept], positions=self.positions[kept])

    def _on(self, surface: Floats) -> Floats:
        return np.einsum("nc,...nci->...ni", self.barycentric, surface[..., self.faces[self.face], :])

    def compared(self, surface: Frames, slopes: Floats, camera: Camera) -> Residuals:
        """Compares points with predicted surfaces (T, S, 3) m and their slopes (F, T, S, 3) m."""
        predicted, changes = self._on(surface), self._on(slopes)
        values = [1e3 * (row - there).ravel() for row, there in zip(self.positions, predicted, strict=True)]
        along = [1e3 * changes[:, index].reshape(len(changes), -1) for index in range(len(values))]
        causes = [_causes(there, _lever(there)).reshape(-1, 6) for there in predicted]
        return Residuals(values, along, causes)


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points without correspondence: at each time some (N, 3) m anywhere on the surface, as a camera saw them.

    A residual is the distance of a point from the tangent plane of the predicted surface nearest to it, to the outside.
    """

    times: Times
    points: list[Floats]
    faces: Faces
    noise_mm: float
    camera_free: bool = True

    def __post_init__(self) -> None:
        _check(self.times, self.points, self.noise_mm)

    def at(self, kept: Bool[np.ndarray, " times"]) -> "Cloud":
        """The observation of some of the frames."""
        return replace(self, times=self.times[kept], points=[self.points[index] for index in np.flatnonzero(kept)])

    def compared(self, surface: Frames, slopes: Floats, camera: Camera) -> Residuals:
        """Compares clouds, along normals of the nearest faces, with surfaces (T, S, 3) m and slopes (F, T, S, 3) m."""
        out = Residuals([], [], [])
        for index, observed in enumerate(self.points):
            seen = camera.points(observed)
            corners = surface[index][self.faces]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
            middles = corners.mean(axis=1)
            near = KDTree(middles).query(seen)[1]
            normal = normals[near]
            out.values.append(1e3 * ((seen - middles[near]) * normal).sum(axis=1))
            moved = slopes[:, index][:, self.faces[near]].mean(axis=2)
            rows = [1e3 * np.einsum("fni,ni->fn", moved, normal)]
            if self.camera_free:
                arms = seen - surface[0].mean(axis=0)
                turned = np.cross(np.eye(3)[:, None], arms[None])
                camera_rows = np.concatenate([np.broadcast_to(np.eye(3)[:, None], turned.shape), turned])
                rows.append(-1e3 * np.einsum("fni,ni->fn", camera_rows, normal))
                assert len(camera_rows) == POSE
            out.slopes.append(np.concatenate(rows))
            causes = _causes(middles, _lever(surface[index]))[near]
            out.causes.append(np.einsum("ni,nic->nc", normal, causes))
        return out
