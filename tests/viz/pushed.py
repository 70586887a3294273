"""A model of two objects whose motion under a push is a formula."""

from dataclasses import dataclass, replace

import numpy as np
from stubs import StubMotion, StubPredictor

from odeform.checkpoint import Checkpoint
from odeform.models.base import Predictor
from odeform.motion.base import Motion
from odeform.simulation.contacts import vector_of
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.scenes.contact_force import PULSE, SCENE
from odeform.types import Mesh, MotionSequence

__all__ = ["NAMES", "PushedMotion", "PushedPredictor", "pushed_truth"]

NAMES = ("donut", "pillow")
SCHEMA = replace(SCENE.schema, objects=NAMES, parameters=SCENE.schema.learned)
SHIFT, DENT, WIDTH = 0.005, 0.002, 0.03  # m per N, m per N, m


@dataclass(frozen=True, eq=False)
class PushedMotion(StubMotion):
    """Until the end of the pulse the body glides along the force, and is dented around the contact."""

    def pose(self, t):
        out = np.tile(np.eye(4), (np.size(t), 1, 1))
        out[:, :3, 3] = SHIFT * np.minimum(np.ravel(t), PULSE)[:, None] / PULSE * vector_of(self.parameters, "force")
        return out[0] if np.ndim(t) == 0 else out

    def local(self, t):
        away = np.linalg.norm(self.geometry.points - vector_of(self.parameters, "contact"), axis=1)
        dent = DENT * np.exp(-((away / WIDTH) ** 2))[:, None] * vector_of(self.parameters, "force")
        out = (np.minimum(np.ravel(t), PULSE)[:, None, None] / PULSE * dent).astype(np.float32)
        return out[0] if np.ndim(t) == 0 else out


class PushedPredictor(StubPredictor):
    """Knows the donut and the pillow."""

    def __init__(self) -> None:
        bodies = {name: get_object(name).rest_mesh() for name in NAMES}
        arrays = {f"{name}/rest.{key}": getattr(body, key) for name, body in bodies.items() for key in KEYS}
        arrays |= {f"rest.{key}": arrays[f"{NAMES[0]}/rest.{key}"] for key in KEYS}
        Predictor.__init__(self, Checkpoint("stub", SCHEMA, {}, arrays))
        self.solved, self.delay = [], lambda: None

    def _solve(self, geometry, parameters, settings, until, observed) -> Motion:
        self.delay()
        self.solved.append(parameters)
        return PushedMotion(self.schema, parameters, geometry)


KEYS = ("points", "faces")


def pushed_truth(predictor: PushedPredictor, parameters: dict[str, object]) -> MotionSequence:
    """The motion of the stub as a sequence."""
    motion = predictor.solve(None, parameters)
    body = motion.geometry
    assert isinstance(body, Mesh)
    times = SCHEMA.window.times
    weights = np.full(len(body.points), 1.0 / len(body.points), np.float32)
    return MotionSequence(times, motion.vertices(times), body.faces, weights, dict(motion.parameters))
