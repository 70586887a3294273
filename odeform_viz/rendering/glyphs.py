"""Arrows that stand for parameters of a scene."""

import numpy as np
import viser

from odeform.geometry.rigid import rotation_z
from odeform.motion.base import Motion
from odeform.types import Points
from odeform_viz.colors import ARROW

__all__ = ["show_glyphs"]


def show_glyphs(server: viser.ViserServer, root: str, motion: Motion, rest: Points) -> None:
    """Draw the push on a body at rest (N, 3) in m, for scenes that have one.

    It starts on the far side of the body: it acts low on the near side, where the floor would hide most of an arrow.
    """
    parameters = motion.parameters
    if not {"force", "elevation"} <= set(parameters):
        return
    size = float(np.ptp(rest, axis=0).max())
    elevation = parameters["elevation"]
    heading = rotation_z(motion.schema.azimuth(parameters))
    direction = heading @ np.array([np.cos(elevation), 0.0, np.sin(elevation)])
    start = 0.5 * (rest.min(axis=0) + rest.max(axis=0)) + 0.55 * size * direction
    force = next(p for p in motion.schema.parameters if p.name == "force")
    length = size * max(parameters["force"], 0.0) / force.high
    shaft = np.array([[start, start + length * direction]], dtype=np.float32)
    server.scene.add_arrows(
        f"{root}/pulse",
        shaft,
        ARROW,
        shaft_radius=0.02 * size,
        head_radius=0.055 * size,
        head_length=0.12 * size,
    )
