"""The path of a body's centre."""

import numpy as np
import viser

from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.types import Vector
from odeform_viz.colors import Color

__all__ = ["show_path"]

SEGMENTS = 60


def show_path(
    server: viser.ViserServer, root: str, motion: Motion | RecordedMotion, centre: Vector, color: Color
) -> None:
    """Draw where `centre` (3,) m of the body at rest moves over the trained window."""
    window = motion.schema.window
    poses = motion.pose(np.linspace(window.start, window.stop, SEGMENTS + 1))
    points = poses[:, :3, :3] @ centre + poses[:, :3, 3]
    server.scene.add_line_segments(
        f"{root}/path",
        np.stack([points[:-1], points[1:]], axis=1).astype(np.float32),
        colors=np.array(color, dtype=np.uint8),
        thickness=2.0,
        thickness_units="screen",
    )
