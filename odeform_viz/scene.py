"""Frames -> viser handles: columns side by side under one camera, the floor, the pulse."""

from collections.abc import Callable, Sequence

import numpy as np
import viser
import viser.transforms as vtf

from odeform.geometry.rigid import rotation_z
from odeform.model.motion import Motion
from odeform.types import Floats, GaussianSplats, Geometry, Ints, Mesh
from odeform_viz.session import Column, ColumnFrame, Frame

__all__ = ["SceneView", "checker_parts"]

COLORS = ((206, 78, 26), (30, 92, 190), (48, 132, 66), (126, 66, 172), (90, 90, 90))
ARROW = (190, 20, 20)


def checker_parts(mesh: Mesh) -> list[tuple[Ints, Ints]]:
    """A mesh in two parts, octants about its centre in turn: for each the vertices (M,) it uses and its faces (F, 3).

    A body of one colour hides how it turns.
    """
    points = np.asarray(mesh.points, dtype=float)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    odd = np.prod(points[mesh.faces].mean(axis=1) - centre, axis=1) > 0.0
    parts = []
    for faces in (mesh.faces[odd], mesh.faces[~odd]):
        used, local = np.unique(faces, return_inverse=True)
        parts.append((used, local.reshape(-1, 3)))
    return [part for part in parts if len(part[0])]


Update = Callable[[Floats, Floats | None], None]
"""Shows points (N, 3) and, of splats, covariances (N, 3, 3): None for those at rest."""


def _show_shape(server: viser.ViserServer, root: str, geometry: Geometry, color: tuple[int, int, int]) -> Update:
    """Add a shape to the scene; returns what moves it."""
    points = np.asarray(geometry.points, dtype=np.float32)
    if isinstance(geometry, Mesh):
        return _show_mesh(server, root, geometry, color)
    if isinstance(geometry, GaussianSplats):
        return _show_splats(server, root, geometry)
    cloud = server.scene.add_point_cloud(f"{root}/points", points, color, point_size=0.003)

    def move(points: Floats, _: Floats | None) -> None:
        cloud.points = points

    return move


def _show_mesh(server: viser.ViserServer, root: str, mesh: Mesh, color: tuple[int, int, int]) -> Update:
    points = np.asarray(mesh.points, dtype=np.float32)
    red, green, blue = (round(0.45 * c + 0.55 * 235) for c in color)
    handles = []
    for index, ((used, faces), shade) in enumerate(zip(checker_parts(mesh), (color, (red, green, blue)), strict=False)):
        handle = server.scene.add_mesh_simple(f"{root}/part_{index}", points[used], faces, color=shade)
        handles.append((handle, used))

    def move(points: Floats, _: Floats | None) -> None:
        for handle, used in handles:
            handle.vertices = points[used]

    return move


def _show_splats(server: viser.ViserServer, root: str, splats: GaussianSplats) -> Update:
    # covariances travel as float16, which loses splats under half a millimetre: send centimetres, scale the node
    scale = 0.01
    resting = (splats.covariances / scale**2).astype(np.float32)
    colors, opacities = splats.colors.astype(np.float32), splats.opacities[:, None].astype(np.float32)
    centers = (splats.points / scale).astype(np.float32)
    handle = server.scene.add_gaussian_splats(f"{root}/splats", centers, resting, colors, opacities, scale=scale)

    def move(points: Floats, covariances: Floats | None) -> None:
        shown = resting if covariances is None else covariances / np.float32(scale**2)
        handle.set_gaussians((points / scale).astype(np.float32), shown, colors, opacities)

    return move


class _ColumnView:
    """The nodes of one column: a frame that carries the pose, and in it a shape whose points carry the deformation.

    The pose travels with the world's offset, the points one rendering later: were they to carry the whole motion, a
    body that the camera follows would tremble.
    """

    def __init__(self, server: viser.ViserServer, root: str, column: Column, color: tuple[int, int, int]) -> None:
        self._server, self._geometry = server, column.geometry
        self._body = server.scene.add_frame(f"{root}/body", show_axes=False)
        self._shape = _show_shape(server, f"{root}/body", column.geometry, color)
        self._resting = True
        self._root, self._color = root, color

    def show(self, frame: ColumnFrame) -> None:
        self._body.wxyz = vtf.SO3.from_matrix(frame.pose[:3, :3]).wxyz
        self._body.position = frame.pose[:3, 3]
        if frame.points is not None:
            self._shape(frame.points, frame.covariances)
        elif not self._resting:
            self._shape(np.asarray(self._geometry.points, dtype=np.float32), None)
        self._resting = frame.points is None

    def show_path(self, motion: Motion) -> None:
        """The way of the body's centre over the trained window."""
        window = motion.schema.window
        poses = motion.pose(np.linspace(window.start, window.stop, 61))
        centre = np.asarray(motion.geometry.points, dtype=float).mean(axis=0)
        way = poses[:, :3, :3] @ centre + poses[:, :3, 3]
        segments = np.stack([way[:-1], way[1:]], axis=1).astype(np.float32)
        self._server.scene.add_line_segments(
            f"{self._root}/path",
            segments,
            colors=np.array(self._color, dtype=np.uint8),
            thickness=2.0,
            thickness_units="screen",
        )


def _centre(frame: ColumnFrame) -> Floats:
    """(3,) where the rigid part takes the centre of the body."""
    centre = np.asarray(frame.motion.geometry.points, dtype=float).mean(axis=0)
    return frame.pose[:3, :3] @ centre + frame.pose[:3, 3]


class SceneView:
    """Everything in the viewport."""

    def __init__(self, server: viser.ViserServer, columns: Sequence[Column]) -> None:
        self._server, self._columns = server, columns
        self.follow = True
        extent = float(np.ptp(columns[0].geometry.points, axis=0).max())
        self._gap, self._size = 1.6 * extent, extent
        self._set_stage()
        self._frames, self._views, self._labels = [], [], []
        for index, column in enumerate(columns):
            root = f"/world/column_{index}"
            self._frames.append(server.scene.add_frame(root, show_axes=False, position=self._place(index)))
            self._views.append(_ColumnView(server, root, column, COLORS[index % len(COLORS)]))
            if len(columns) > 1:
                # a label lags where its own position changes, not where its parent's does
                self._labels.append(server.scene.add_frame(f"{root}/above", show_axes=False))
                server.scene.add_label(f"{root}/above/label", column.label, position=(0.0, 0.0, 0.75 * extent))
        self._motions: list[Motion | None] = [None] * len(columns)

    def _place(self, index: int) -> tuple[float, float, float]:
        """Columns stand in a row across the default heading, from left to right."""
        return (0.0, self._gap * (0.5 * (len(self._columns) - 1) - index), 0.0)

    def _set_stage(self) -> None:
        server, size = self._server, self._size
        wide = 1.0 + 0.45 * (len(self._columns) - 1)
        server.scene.set_up_direction("+z")
        server.initial_camera.position = (-3.9 * size * wide, -2.6 * size * wide, 1.9 * size * wide)
        # the panel covers the right third of the view: look past the body's right side
        server.initial_camera.look_at = (0.3 * size, -0.45 * size, 0.45 * size)
        server.initial_camera.fov = 0.7
        self._world = server.scene.add_frame("/world", show_axes=False)
        server.scene.add_grid(
            "/world/floor",
            infinite_grid=True,
            cell_size=0.1,
            section_size=0.5,
            cell_color=(205, 208, 214),
            section_color=(150, 156, 168),
            fade_distance=60.0 * size,
            shadow_opacity=0.35,
            plane_color=(243, 244, 247),
            plane_opacity=1.0,
        )

    def publish(self, frame: Frame) -> None:
        """Send one frame, whole: clients never see half of it. What only accompanies a motion follows it."""
        with self._server.atomic():
            for index, column in enumerate(frame.columns):
                self._frames[index].visible = column is not None
                if column is None:
                    continue
                self._views[index].show(column)
                if self._labels:
                    self._labels[index].position = _centre(column)
            self._world.position = self._offset(frame)
        self._server.flush()
        for index, column in enumerate(frame.columns):
            if column is not None and self._motions[index] is not column.motion:
                self._motions[index] = column.motion
                with self._server.atomic():
                    self._views[index].show_path(column.motion)
                    self._show_pulse(index, column.motion)

    def _offset(self, frame: Frame) -> tuple[float, float, float]:
        """Following moves the world past the camera, which stays in the user's hand."""
        first = next((column for column in frame.columns if column is not None), None)
        if not self.follow or first is None:
            return (0.0, 0.0, 0.0)
        moved = _centre(first) - np.asarray(first.motion.geometry.points, dtype=float).mean(axis=0)
        return (-float(moved[0]), -float(moved[1]), 0.0)

    def _show_pulse(self, index: int, motion: Motion) -> None:
        """The push, on the side where it drives the body, as long as it is strong; only scenes with a force have one.

        It acts on the far side, low at the back, where the floor would hide most of an arrow.
        """
        parameters = motion.parameters
        if not {"force", "elevation"} <= set(parameters):
            return
        elevation = parameters["elevation"]
        heading = rotation_z(motion.schema.azimuth(parameters))
        direction = heading @ np.array([np.cos(elevation), 0.0, np.sin(elevation)])
        points = np.asarray(motion.geometry.points, dtype=float)
        centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        start = centre + 0.55 * self._size * direction
        force = next(p for p in motion.schema.parameters if p.name == "force")
        length = self._size * max(parameters["force"], 0.0) / force.high
        shaft = np.array([[start, start + length * direction]], dtype=np.float32)
        self._server.scene.add_arrows(
            f"/world/column_{index}/pulse",
            shaft,
            ARROW,
            shaft_radius=0.02 * self._size,
            head_radius=0.055 * self._size,
            head_length=0.12 * self._size,
        )
