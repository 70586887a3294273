"""The round floor under each of several columns. Its lines pass under a body that is followed."""

import numpy as np
import viser

from odeform.types import Floats
from odeform_viz.colors import Color

__all__ = ["FloorDisc", "chords"]

CELL = 0.1  # m between lines
THICKNESS = 0.03  # in radii
SHADOW = 0.35  # opacity
OPACITY = 0.16  # light where the background is light, dark where it is dark
LINES = (150, 155, 165)


class FloorDisc:
    """A disc at z = 0 around the origin of the node `root`."""

    def __init__(self, server: viser.ViserServer, root: str, radius: float, color: Color) -> None:
        """`radius` is in metres; `color` is that of the column's curves."""
        self.radius = radius
        thickness = THICKNESS * radius
        self._node = server.scene.add_frame(f"{root}/disc", show_axes=False)
        server.scene.add_cylinder(
            f"{root}/disc/floor",
            radius,
            thickness,
            color,
            opacity=OPACITY,
            radial_segments=64,
            position=(0.0, 0.0, -0.5 * thickness),
            cast_shadow=False,
            receive_shadow=SHADOW,
        )
        self._lines = server.scene.add_line_segments(
            f"{root}/disc/lines",
            chords(radius, (0.0, 0.0)),
            LINES,
            thickness=1.0,
            thickness_units="screen",
            position=(0.0, 0.0, 0.01 * radius),
        )
        self._shift = (0.0, 0.0)

    def scroll(self, x: float, y: float) -> None:
        """Show the floor shifted by x and y, in metres."""
        if (x, y) != self._shift:
            self._shift = (x, y)
            self._lines.points = chords(self.radius, (x, y))

    def remove(self) -> None:
        """Remove the disc from the scene."""
        self._node.remove()


def chords(radius: float, shift: tuple[float, float]) -> Floats:
    """The lines (L, 2, 3) of a square grid through `shift` that lie within `radius` of the origin, in m.

    L does not depend on the shift: a line that misses the disc is a point on its edge.
    """
    count = int(np.ceil(radius / CELL))
    out = np.zeros((2, 2 * count + 1, 2, 3), dtype=np.float32)
    for axis in (0, 1):
        at = np.clip(CELL * np.arange(-count, count + 1) + shift[axis] % CELL, -radius, radius)
        half = np.sqrt(radius**2 - at**2)
        out[axis, :, :, axis] = at[:, None]
        out[axis, :, 0, 1 - axis], out[axis, :, 1, 1 - axis] = -half, half
    return out.reshape(-1, 2, 3)
