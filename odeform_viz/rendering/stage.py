"""What surrounds the columns: the default camera, the floor, and the part of a captured scene that does not move."""

import viser

from odeform.types import GaussianSplats, Geometry
from odeform_viz.colors import BACKGROUND
from odeform_viz.rendering.shapes import show_shape
from odeform_viz.view import Frame

__all__ = ["Stage"]

SINK = 0.01  # of the body's size


class Stage:
    """The world, with a floor or a background of its own."""

    ROOT = "/world"

    def __init__(self, server: viser.ViserServer, extent: float, columns: int) -> None:
        """`extent` is the size of a body in metres; the initial camera shows `columns` of them side by side."""
        self._server, self._extent = server, extent
        self._background: tuple[Geometry, viser.FrameHandle] | None = None
        _set_camera(server, extent, columns)
        self._world = server.scene.add_frame(self.ROOT, show_axes=False)
        self._floor = server.scene.add_grid(
            f"{self.ROOT}/floor",
            infinite_grid=True,
            cell_size=0.1,
            section_size=0.5,
            cell_color=(205, 208, 214),
            section_color=(150, 156, 168),
            fade_distance=60.0 * extent,
            shadow_opacity=0.35,
            plane_color=(243, 244, 247),
            plane_opacity=1.0,
        )

    def show(self, frame: Frame) -> None:
        """Send the background when it changes; it has a floor of its own. It is shared by all columns."""
        # a floor at zero would cut through splats that lie on it
        splats = any(isinstance(shown.column.geometry, GaussianSplats) for shown in frame.columns)
        self._floor.position = (0.0, 0.0, -SINK * self._extent if splats else 0.0)
        if frame.still is (self._background and self._background[0]):
            return
        if self._background is not None:
            self._background[1].remove()
            self._background = None
        if frame.still is not None:
            node = f"{self.ROOT}/still"
            self._background = (frame.still, self._server.scene.add_frame(node, show_axes=False))
            show_shape(self._server, node, frame.still, BACKGROUND)
        self._floor.visible = frame.still is None

    def place_background(self, geometry: Geometry, lane: float) -> None:
        """Move the background to `lane`, metres along y, if it is `geometry`."""
        if self._background is not None and geometry is self._background[0]:
            self._background[1].position = (0.0, lane, 0.0)

    def shift(self, x: float, y: float) -> None:
        """Move the whole world, in metres, past a camera that the user controls."""
        self._world.position = (x, y, 0.0)


def _set_camera(server: viser.ViserServer, extent: float, columns: int) -> None:
    wide = 1.0 + 0.45 * (columns - 1)
    server.scene.set_up_direction("+z")
    server.initial_camera.position = (-3.9 * extent * wide, -2.6 * extent * wide, 1.9 * extent * wide)
    # the panel covers the right third of the view: aim past the body's right side
    server.initial_camera.look_at = (0.3 * extent, -0.45 * extent, 0.45 * extent)
    server.initial_camera.fov = 0.7
