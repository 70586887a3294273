"""The path of a body's centre."""

import numpy as np
import viser

from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.types import Vector
from odeform_viz.colors import Color
from odeform_viz.rendering.glb import LINEAR
from odeform_viz.view import shown_until

__all__ = ["show_path"]

SEGMENTS = 240
CONTINUED = 0.45  # strength of the color after the trained window


def show_path(
    server: viser.ViserServer, root: str, motion: Motion | RecordedMotion, centre: Vector, color: Color
) -> viser.LineSegmentsHandle:
    """Draw where `centre` (3,) m of the body at rest moves, to the end of the time slider; paler once extrapolated."""
    window = motion.schema.window
    times = np.linspace(window.start, shown_until(window), SEGMENTS + 1)
    poses = motion.pose(times)
    points = poses[:, :3, :3] @ centre + poses[:, :3, 3]
    strength = np.where(times[:-1] < window.stop, 1.0, CONTINUED)[:, None, None]
    mixed = np.round(255.0 + strength * (np.array(color) - 255.0)).astype(np.uint8)
    colors = (LINEAR[mixed] >> 8).astype(np.uint8)  # viser takes colors of several segments as linear
    return server.scene.add_line_segments(
        f"{root}/path",
        np.stack([points[:-1], points[1:]], axis=1).astype(np.float32),
        colors=np.repeat(colors, 2, axis=1),
        thickness=2.0,
        thickness_units="screen",
    )
