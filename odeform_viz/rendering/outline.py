"""What a body covers in the plane of the view while it moves, and what acts on it."""

import numpy as np

from odeform.loads.registry import first_body, meets_twin
from odeform.motion.base import Motion
from odeform.simulation.scenes.registry import find_scene
from odeform.types import Floats, Pose, Vector
from odeform_viz.obstacles import obstacles_of
from odeform_viz.pushing import push_shown
from odeform_viz.rendering.framing import Axes, Box
from odeform_viz.view import ColumnFrame

__all__ = ["climb_of", "direction_of", "outline_of"]

MOMENTS = 60  # of a motion that are looked at
POINTS = 200  # of a body


def _acting_on(shown: ColumnFrame) -> Floats | None:
    """(2, 3) m: tail and head of the arrow of what acts first on a body; None if nothing does."""
    push = push_shown(shown.column, shown.motion)
    if push is not None:
        return np.stack(push.arrow)
    scene = find_scene(shown.motion.schema.scene)
    if scene is None or not isinstance(shown.motion, Motion):
        return None
    arrows = scene.glyphs(shown.motion.parameters, np.asarray(shown.column.geometry.points, dtype=np.float32))
    return np.stack([arrows[0].start, arrows[0].start + arrows[0].vector]) if arrows else None


def outline_of(shown: ColumnFrame, axes: Axes, travels: bool) -> Box:
    """The box of the body within the trained window, of what acts on it, and of the middle of obstacles.

    Where it goes along the floor counts if it `travels` through the view, and not if the view follows it.
    """
    poses = _poses(shown)
    points = _points(shown)
    points = points[:: max(len(points) // POINTS, 1)]
    centre = points.mean(axis=0)
    turned = np.einsum("tij,nj->tni", poses[:, :3, :3], points - centre)
    centres = poses[:, :3, :3] @ centre + poses[:, :3, 3]
    if not travels:
        centres[:, :2] = centre[:2]
    turned += centres[:, None]
    acting = _acting_on(shown)
    parts = [turned.reshape(-1, 3)] if acting is None else [turned.reshape(-1, 3), acting]
    parts += [obstacle.mesh.points * [1.0, 0.0, 1.0] for obstacle in obstacles_of(shown.motion)]
    if meets_twin(shown.motion.schema.scene):
        parts.append(_twin(shown))
    corners = np.concatenate(parts)
    across, upwards = corners @ axes.right, corners @ axes.above
    return Box(float(across.min()), float(across.max()), float(upwards.min()), float(upwards.max()))


def _points(shown: ColumnFrame) -> Floats:
    """(N, 3) m: the body at rest that the pose moves."""
    points = np.asarray(shown.column.geometry.points, dtype=float)
    return points[first_body(shown.motion.schema.scene, len(points))]


def _twin(shown: ColumnFrame) -> Floats:
    """(M, 3) m: where the other body is, at its start and at the end of the trained window."""
    window = shown.motion.schema.window
    frames = shown.motion.vertices(np.array([window.start, window.stop]))
    return frames[:, first_body(shown.motion.schema.scene, frames.shape[1]).stop :].reshape(-1, 3).astype(float)


def _poses(shown: ColumnFrame) -> Pose:
    """(T, 4, 4) over the trained window."""
    window = shown.motion.schema.window
    return shown.motion.pose(np.linspace(window.start, window.stop, MOMENTS))


def climb_of(shown: ColumnFrame) -> float:
    """Metres by which the centre of the body rises at most within the trained window."""
    centre, poses = _points(shown).mean(axis=0), _poses(shown)
    return float((poses[:, 2, :3] @ centre + poses[:, 2, 3]).max() - centre[2])


def direction_of(shown: ColumnFrame) -> Vector | None:
    """(3,) the direction in which a body is pushed, or that of an obstacle; None if nothing acts."""
    for obstacle in obstacles_of(shown.motion):
        return -obstacle.met(_poses(shown)[0, :3, 3])[1] * [1.0, 1.0, 0.0]
    acting = _acting_on(shown)
    return None if acting is None else acting[1] - acting[0]
