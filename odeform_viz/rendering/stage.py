"""Draws what surrounds the columns: the floor, and the part of a captured scene that does not move."""

import numpy as np
import viser
from viser._messages import SceneNodeUpdateMessage

from odeform.types import Floats, GaussianSplats, Geometry
from odeform_viz.colors import BACKGROUND
from odeform_viz.rendering.shapes import show_shape
from odeform_viz.view import Frame

__all__ = ["Stage", "set_floor_theme"]

LOWERED = 0.01  # of the body's size
LIGHT = {"cell_color": (205, 208, 214), "section_color": (150, 156, 168), "plane_color": (243, 244, 247)}
DARK = {"cell_color": (52, 55, 61), "section_color": (84, 89, 99), "plane_color": (27, 29, 33)}


class Stage:
    """The world, with a floor or a background of its own."""

    ROOT = "/world"

    def __init__(self, server: viser.ViserServer, extent: float) -> None:
        """`extent` is the size of a body in metres."""
        self._server, self._extent = server, extent
        self._background: tuple[Geometry, viser.FrameHandle] | None = None
        self._world = server.scene.add_frame(self.ROOT, show_axes=False)
        self._floor = server.scene.add_grid(
            f"{self.ROOT}/floor",
            infinite_grid=True,
            cell_size=0.1,
            section_size=0.5,
            fade_distance=60.0 * extent,
            shadow_opacity=0.35,
            plane_opacity=1.0,
            cell_color=LIGHT["cell_color"],
            section_color=LIGHT["section_color"],
            plane_color=LIGHT["plane_color"],
        )

    def show(self, frame: Frame, discs: bool) -> None:
        """Send the background when it changes; it is shared by all columns, and has a floor of its own.

        With `discs`, each column has a floor of its own as well.
        """
        # a floor at zero would cut through splats that lie on it
        splats = any(isinstance(shown.column.geometry, GaussianSplats) for shown in frame.columns)
        self._floor.position = (0.0, 0.0, -LOWERED * self._extent if splats else 0.0)
        self._floor.visible = frame.still is None and not discs
        if frame.still is (self._background and self._background[0]):
            return
        if self._background is not None:
            self._background[1].remove()
            self._background = None
        if frame.still is not None:
            node = f"{self.ROOT}/still"
            self._background = (frame.still, self._server.scene.add_frame(node, show_axes=False))
            show_shape(self._server, node, frame.still, BACKGROUND)

    def place_background(self, geometry: Geometry, offset: Floats) -> None:
        """Move the background to `offset` (3,) m, if it is `geometry`."""
        if self._background is not None and geometry is self._background[0]:
            self._background[1].position = offset

    @property
    def position(self) -> Floats:
        """(3,) m: where the world is; see `shift`."""
        return np.asarray(self._world.position, dtype=float)

    def shift(self, by: Floats) -> None:
        """Move the whole world by (3,) m, past a camera that the user controls."""
        self._world.position = by


def set_floor_theme(client: viser.ClientHandle, dark: bool) -> None:
    """Color the floor for one client; viser's handles change it for all."""
    update = SceneNodeUpdateMessage(f"{Stage.ROOT}/floor", dict(DARK if dark else LIGHT))
    client.scene._websock_interface.queue_message(update)
