"""A model whose motion is a formula: what tests of the viewer need instead of a trained one."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh

from odeform.checkpoint import Checkpoint
from odeform.models.base import Predictor
from odeform.motion.base import Motion, SolveStats
from odeform.schema import Parameter, Parameters, Schema, Window
from odeform.solver.integrate import SolverSettings
from odeform.types import Geometry, Mesh, MotionSequence

__all__ = ["SCHEMA", "StubMotion", "StubPredictor", "recorded"]

SCHEMA = Schema(
    "stub",
    (
        Parameter("mass", "kg", 0.4, 1.0, 0.7, "log", description="mass of the body"),
        Parameter("spring", "N/m", 1.0, 5.0, 2.0, description="stiffness of the body"),
    ),
    Window(0.0, 1.0, 120.0, 0.5),
    notes=("It exists in tests only.",),
)
PEAK = 0.25  # s; the largest deformation
SIZE = 0.2  # m


def _body() -> Mesh:
    sphere = trimesh.creation.icosphere(2, 0.5 * SIZE)
    return Mesh(
        np.asarray(sphere.vertices + np.array([0.0, 0.0, 0.5 * SIZE]), np.float32), np.asarray(sphere.faces, np.int32)
    )


@dataclass(frozen=True, eq=False)
class StubMotion(Motion):
    """Glides along x at 1 m/s per kg, and is squeezed along z by a tenth per N/m at `PEAK`."""

    schema: Schema
    parameters: Parameters
    geometry: Geometry
    solver: str = "stub"

    @property
    def stats(self) -> SolveStats:
        return SolveStats(self.solver, 10, 40, 0, "ok", 0.1, lambda: 0.01)

    @property
    def last_good(self) -> float:
        return np.inf

    def pose(self, t):
        out = np.tile(np.eye(4), (np.size(t), 1, 1))
        out[:, 0, 3] = self.parameters["mass"] * np.ravel(t)
        return out[0] if np.ndim(t) == 0 else out

    def local(self, t):
        squeeze = np.exp(-(((np.ravel(t) - PEAK) / 0.2) ** 2)) - np.exp(-((PEAK / 0.2) ** 2))
        squeeze = np.where(np.ravel(t) > 0.0, squeeze, 0.0) * 0.02 * self.parameters["spring"]
        out = np.zeros((np.size(t), len(self.geometry.points), 3), np.float32)
        out[:, :, 2] = -squeeze[:, None] * self.geometry.points[:, 2]
        return out[0] if np.ndim(t) == 0 else out

    def deformed(self, t):
        return (self.geometry.points + self.local(t)).astype(np.float32)

    def vertices(self, t):
        poses, local = self.pose(np.atleast_1d(t)), self.local(np.atleast_1d(t))
        out = (self.geometry.points + local + poses[:, None, :3, 3]).astype(np.float32)
        return out[0] if np.ndim(t) == 0 else out

    def covariances(self, t):
        return self.deformed_covariances(t)

    def deformed_covariances(self, t):
        return self.geometry.covariances

    def deformation_bound(self, time):
        return float(np.linalg.norm(self.local(time), axis=1).max())

    def deformation_rms(self, times):
        return np.sqrt((self.local(times) ** 2).sum(axis=2).mean(axis=1))


class StubPredictor(Predictor):
    """Counts its motions in `solved`. `delay`, if set, is called before each."""

    model = "stub"
    qualities = {"draft": SolverSettings("rk4", step=0.1), "balanced": SolverSettings("rk4", step=0.01)}  # noqa: RUF012

    def __init__(self, schema: Schema = SCHEMA, **provenance: Any) -> None:
        body = _body()
        arrays = {"rest.points": body.points, "rest.faces": body.faces}
        super().__init__(Checkpoint("stub", schema, {}, arrays, provenance, {"rmse_pooled_mm": 1.5}))
        self.solved: list[Parameters] = []
        self.delay: Callable[[], None] = lambda: None

    def _read(self, checkpoint: Checkpoint) -> None:
        """It has nothing but a body."""

    def _solve(self, geometry, parameters, settings, until, observed) -> Motion:
        self.delay()
        self.solved.append(parameters)
        return StubMotion(self.schema, parameters, geometry, settings.method if settings else "none")


def recorded(predictor: StubPredictor, parameters: dict[str, float], shift: float = 0.001) -> MotionSequence:
    """The motion of a stub as a sequence, `shift` metres higher: that is its error, divided by the square root of 3."""
    motion = predictor.solve(None, parameters)
    times = predictor.schema.window.times
    frames = motion.vertices(times) + np.float32([0.0, 0.0, shift]) * (times > 0.0)[:, None, None].astype(np.float32)
    weights = np.full(frames.shape[1], 1.0 / frames.shape[1], np.float32)
    return MotionSequence(times, frames, predictor.rest.faces, weights, motion.parameters)
