"""Nodes of a mesh in viser's scene: a checkerboard, or a color for each vertex."""

import numpy as np
import viser

from odeform.geometry.split_colors import split_colors
from odeform.types import Faces, Floats, Mesh, Points
from odeform_viz.colors import CLAY, Color, darker
from odeform_viz.rendering.checkerboard import Part, checkerboard_parts
from odeform_viz.rendering.glb import GlbWriter
from odeform_viz.rendering.look import Colors, Look

__all__ = ["MeshView"]


DOT, DOTS = 0.014, 400  # sizes of a body, across a point that is drawn of it; points, about


class MeshView:
    """A mesh whose vertices move. Only one of its kinds of nodes is visible, and only that is updated."""

    def __init__(self, server: viser.ViserServer, root: str, mesh: Mesh) -> None:
        self._rest = np.asarray(mesh.points, dtype=np.float32)
        given = split_colors(mesh)
        radius = _radius(mesh)
        own = given and _Colored(server, f"{root}/own", len(given.vertices), given.faces, radius, unlit=False)
        self._given = (given, own) if given and own else None
        self._checkerboard = _Checkerboard(server, root, mesh) if given is None else None
        self._colored = _Colored(server, f"{root}/colored", len(mesh.points), mesh.faces, radius, unlit=True)
        self._dots = _Dots(server, f"{root}/dots")

    def show(self, points: Points | None, covariances: Floats | None, look: Look) -> None:
        """See `ShapeView`: (N, 3) m. A mesh has no covariances."""
        present = self._rest if points is None else points
        if look.dots or look.colors is not None:
            if self._given is not None:
                self._given[1].hide()
            if self._checkerboard is not None:
                self._checkerboard.hide()
        if look.dots:
            self._colored.hide()
            self._dots.show(present, look.tint or CLAY)
            return
        self._dots.hide()
        if look.colors is not None:
            self._colored.show(present, look.colors, look)
            return
        self._colored.hide()
        if self._given is not None:
            given, view = self._given
            view.show(present[given.vertices], given.colors, look)
        elif self._checkerboard is not None:
            self._checkerboard.show(points, self._rest, look)


def _radius(mesh: Mesh) -> float:
    """Metres from the origin that the deformed mesh stays within, with room to spare."""
    return 4.0 * float(np.abs(mesh.points).max())


class _Checkerboard:
    """Vertices are sent alone: faces and colors stay as they are."""

    def __init__(self, server: viser.ViserServer, root: str, mesh: Mesh) -> None:
        points = np.asarray(mesh.points, dtype=np.float32)
        self._parts: list[tuple[viser.MeshHandle, Part]] = []
        for index, (part, shade) in enumerate(zip(checkerboard_parts(mesh), _shades(CLAY), strict=False)):
            name, vertices = f"{root}/part_{index}", part.vertices(points)
            self._parts.append(
                (server.scene.add_mesh_simple(name, vertices, part.faces, color=shade, receive_shadow=False), part)
            )
        self._at_rest, self._color = True, CLAY

    def show(self, points: Points | None, rest: Points, look: Look) -> None:
        self._paint(look.tint or CLAY)
        moved = points is not None or not self._at_rest
        for handle, part in self._parts:
            if moved:
                handle.vertices = part.vertices(rest if points is None else points)
            handle.visible, handle.opacity, handle.wireframe = True, look.opacity, look.wireframe
        self._at_rest = points is None

    def _paint(self, color: Color) -> None:
        if color != self._color:
            self._color = color
            for (handle, _), shade in zip(self._parts, _shades(color), strict=False):
                handle.color = shade

    def hide(self) -> None:
        for handle, _ in self._parts:
            handle.visible = False


def _shades(color: Color) -> tuple[Color, Color]:
    return color, darker(color)


class _Dots:
    """Some of the points, which a surface in the same place does not cover in patches."""

    def __init__(self, server: viser.ViserServer, node: str) -> None:
        self._server, self._node = server, node
        self._cloud: viser.PointCloudHandle | None = None

    def show(self, points: Points, color: Color) -> None:
        few = points[:: max(len(points) // DOTS, 1)]
        if self._cloud is None:
            size = DOT * float(np.ptp(points, axis=0).max())
            self._cloud = self._server.scene.add_point_cloud(
                self._node, few, color, point_size=size, point_shape="circle", precision="float32"
            )
        else:
            self._cloud.points, self._cloud.visible = few, True

    def hide(self) -> None:
        if self._cloud is not None:
            self._cloud.visible = False


class _Colored:
    """Everything is sent with each change: viser colors vertices in glTF files only."""

    def __init__(
        self, server: viser.ViserServer, node: str, count: int, faces: Faces, radius: float, unlit: bool
    ) -> None:
        self._server, self._node, self._mesh, self._unlit = server, node, (count, faces, radius), unlit
        self._writer: tuple[object, GlbWriter] | None = None
        self._handle: viser.GlbHandle | None = None
        self._sent: tuple[Points, Colors, object] | None = None

    def show(self, points: Points, colors: Colors, look: Look) -> None:
        layout = (look.opacity, look.wireframe)
        if self._handle is not None:
            self._handle.visible = True
        sent = self._sent
        if sent is not None and sent[1] is colors and sent[2] == layout and np.array_equal(sent[0], points):
            return
        self._sent = (points, colors, layout)
        if self._writer is None or self._writer[0] != layout:
            self._writer = (layout, GlbWriter(*self._mesh, look.opacity, look.wireframe, self._unlit))
        data = self._writer[1].write(points, colors)
        if self._handle is None:
            self._handle = self._server.scene.add_glb(self._node, data, receive_shadow=False)
        else:
            self._handle.glb_data = data

    def hide(self) -> None:
        if self._handle is not None:
            self._handle.visible = False
