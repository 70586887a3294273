"""What a body covers in the plane of the view while it moves, and what acts on it."""

import math

import numpy as np

from odeform.loads.registry import first_body, load_of_scene, meets_twin
from odeform.motion.base import Motion
from odeform.simulation.scenes.registry import find_scene
from odeform.types import Floats, Frames, Points, Pose, Vector
from odeform_viz.obstacles import obstacles_of
from odeform_viz.pushing import push_shown
from odeform_viz.rendering.framing import Axes, Box
from odeform_viz.view import ColumnFrame, played_until

__all__ = ["RISE", "ceiling_of", "direction_of", "outline_of", "reach_of"]

MOMENTS = 60  # of a motion that are looked at
POINTS = 200  # of a body
FEW = 9  # moments of two bodies, of which each takes as long as many of one
ROOM = 1.05  # around what these moments show
AWAY = 5.0  # heights of a box alone, from which the camera looks at it
LABEL = 0.13  # of a body's size: the handle at an arrow's tail, and the label above it
AROUND = np.array([[0.0, 0.0, 1.0], [0.7, 0.0, 0.0], [-0.7, 0.0, 0.0], [0.0, 0.7, 0.0], [0.0, -0.7, 0.0]])
RISE = 0.25  # of a body's size: what rises higher is followed, so that bodies that fall are not seen from far away


def _acting_on(shown: ColumnFrame) -> Floats | None:
    """(A, 3) m: tail and head of the arrow of what acts first on a body, and what stands over it; None if nothing
    acts."""
    push = push_shown(shown.column, shown.motion)
    if push is not None:
        tail, head = push.arrow
        return np.stack([tail, head, *(tail + LABEL * push.size * AROUND)])
    scene = find_scene(shown.motion.schema.scene)
    if scene is None or not isinstance(shown.motion, Motion):
        return None
    arrows = scene.glyphs(shown.motion.parameters, np.asarray(shown.column.geometry.points, dtype=np.float32))
    return np.stack([arrows[0].start, arrows[0].start + arrows[0].vector]) if arrows else None


def outline_of(shown: ColumnFrame, axes: Axes, travels: bool, most: float = math.inf) -> Box:
    """The box of the body within the trained window, of what acts on it, and of the obstacles that it meets.

    Where it goes along the floor counts if it `travels` through the view, and not if the view follows it, as it does
    where the centre is more than `most` m above its lowest.
    """
    if meets_twin(shown.motion.schema.scene) and not travels:
        return _seen(_beside_each_other(shown).reshape(-1, 3), axes)
    poses = _poses(shown)
    points = _points(shown)
    points = points[:: max(len(points) // POINTS, 1)]
    centre = points.mean(axis=0)
    turned = np.einsum("tij,nj->tni", poses[:, :3, :3], points - centre)
    true = poses[:, :3, :3] @ centre + poses[:, :3, 3]
    centres = true.copy()
    if not travels:
        centres[:, :2] = centre[:2]
    centres[:, 2] = np.minimum(true[:, 2], true[:, 2].min() + most)
    turned += centres[:, None]
    acting = _acting_on(shown)
    if acting is not None and _flies(shown):
        acting = acting + centres[0] - true[0]  # the arrow of a velocity goes with the body
    parts = [turned.reshape(-1, 3)] if acting is None else [turned.reshape(-1, 3), acting]
    parts += [obstacle.mesh.points for obstacle in obstacles_of(shown.motion)]
    if meets_twin(shown.motion.schema.scene):
        parts.append(_twin(shown))
    return _seen(np.concatenate(parts), axes)


def reach_of(shown: ColumnFrame) -> float:
    """How far two bodies get from the middle between them along the floor, in m; 0 for one, below which the floor
    passes."""
    if not meets_twin(shown.motion.schema.scene):
        return 0.0
    return ROOM * float(np.hypot(*np.moveaxis(_beside_each_other(shown)[..., :2], -1, 0)).max())


def _beside_each_other(shown: ColumnFrame) -> Frames:
    """(T, N, 3) m: two bodies over what is played, seen from above the middle between them."""
    window = shown.motion.schema.window
    frames = shown.motion.vertices(np.linspace(window.start, played_until(window), FEW)).astype(float)
    frames[..., :2] -= frames[..., :2].mean(axis=1, keepdims=True)
    return frames


def _seen(corners: Points, axes: Axes) -> Box:
    """The box of points (P, 3) m in the picture: what is nearer than the middle looks larger."""
    flat = np.stack([corners @ axes.right, corners @ axes.above], axis=1)
    middle = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
    away = AWAY * max(float(np.ptp(flat[:, 1])), 1e-6)
    nearer = 1.0 / (1.0 - np.minimum((corners @ axes.direction) / away, 0.5))
    (left, low), (right, high) = (
        (edge(middle + (flat - middle) * nearer[:, None], axis=0)).tolist() for edge in (np.min, np.max)
    )
    return Box(left, right, low, high)


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


def ceiling_of(shown: ColumnFrame, most: float) -> float:
    """Metres above the floor up to which the centre of the body rises in the view: at most `most` above its lowest."""
    centre, poses = _points(shown).mean(axis=0), _poses(shown)
    heights = poses[:, 2, :3] @ centre + poses[:, 2, 3]
    return float(min(heights.max(), heights.min() + most))


def _flies(shown: ColumnFrame) -> bool:
    load = load_of_scene(shown.motion.schema.scene)
    return load is not None and load.flies


def direction_of(shown: ColumnFrame) -> Vector | None:
    """(3,) the direction in which a body is pushed, or that of an obstacle; None if nothing acts."""
    for obstacle in obstacles_of(shown.motion):
        return -obstacle.met(_poses(shown)[0, :3, 3])[1] * [1.0, 1.0, 0.0]
    acting = _acting_on(shown)
    return None if acting is None else acting[1] - acting[0]
