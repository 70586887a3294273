"""Displacements of the points of one body, by the network that reads its shape."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.models.points.arithmetic import Net
from odeform.models.points.point_trajectories import TRAJECTORIES, FramedPoints, in_windows
from odeform.models.points.shape_network import ShapeNet, moved_rigidly, point_features
from odeform.motion.point_motion import PointFrame
from odeform.motion.threads import thread_map
from odeform.schema import Window
from odeform.types import Floats, Frames, Points, Rotations, Times

__all__ = ["ShapePush", "ShapeTrajectory", "displaced"]


@dataclass(frozen=True, eq=False)
class ShapePush:
    """A push of a body: what the encoders made of both, and the axes in which they see them."""

    first: tuple[Floats, Floats]
    """The states (1, latent) at rest."""
    contact: Float[np.ndarray, " 3"]
    """In radii of gyration about the centre, in turned axes."""
    turn: Rotations
    """(3, 3): to turned axes."""


def displaced(
    network: ShapeNet, net: Net, states: tuple[Floats, Floats], x: Floats, contact: Floats, frame: PointFrame
) -> tuple[Floats, Floats]:
    """Rigid displacements (F, Q, P, 3) and those of rigid motion after deformation, of points (Q, P, 3) under pushes at
    contacts (Q, 3), all in radii of gyration and turned axes, from states (F, Q, latent). `frame` has the units."""
    unit, finer = frame.scale / frame.gyration_radius, frame.part_scale / frame.gyration_radius
    rigid, deformed = network.decode(net, states, point_features(net, x, contact))
    shift, turn = (unit * rigid[..., None, part] for part in (slice(0, 3), slice(3, 6)))
    return moved_rigidly(net, x, shift, turn) - x, moved_rigidly(net, x + finer * deformed, shift, turn) - x


class ShapeTrajectory(FramedPoints):
    """One latent roll-out of the whole body, decoded for each point."""

    solver, between = "rk4 (3/8 rule)", "cubic"
    stages, doubled = 4, True

    def __init__(
        self, net: Net, network: ShapeNet, frame: PointFrame, window: Window, x: Points, push: ShapePush
    ) -> None:
        """`x` (N, 3) are points in radii of gyration about the centre, in the scene's axes."""
        self._net, self._shapes, self._frame, self._window, self._push = net, network, frame, window, push
        self._x, self._wall_ms = x, 0.0
        self._frames = np.empty((0, len(x), 3), dtype=np.float32)

    def _roll_out(self, grid: Times) -> Frames:
        push, out = self._push, np.empty((len(grid), len(self._x), 3), dtype=np.float32)
        turn = push.turn.astype(np.float32)
        states = self._shapes.states(self._net, push.first, in_windows(grid, self._window))

        def compute(begin: int) -> None:
            x = (self._x[begin : begin + TRAJECTORIES] @ turn.T)[None]
            contact = push.contact.astype(np.float32)[None]
            _, moved = displaced(self._shapes, self._net, states, x, contact, self._frame)
            out[:, begin : begin + TRAJECTORIES] = moved[:, 0] @ turn

        thread_map(compute, range(0, len(self._x), TRAJECTORIES))
        return out * np.float32(self._frame.gyration_radius)
