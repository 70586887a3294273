"""Frames -> viser handles: columns side by side under one camera, the floor, the pulse."""

import numpy as np
import viser
import viser.transforms as vtf

from odeform.geometry.rigid import rotation_z
from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.types import Floats, GaussianSplats, Geometry
from odeform_viz.columns import Column
from odeform_viz.rendering.error_colors import Spread
from odeform_viz.rendering.shapes import Color, show_shape
from odeform_viz.view import INVISIBLE, ColumnFrame, DisplayOptions, Frame

__all__ = ["SceneView", "color_of"]

COLORS = ((206, 78, 26), (30, 92, 190), (48, 132, 66), (126, 66, 172), (176, 42, 98), (0, 128, 140))
TRUTH = (70, 74, 82)
STILL = (188, 190, 186)
ARROW = (190, 20, 20)
GHOST = 0.45  # opacity of all but the first where columns overlap


def color_of(column: Column) -> Color:
    """A model's by its place, the truth grey."""
    return TRUTH if column.truth else COLORS[column.color_index % len(COLORS)]


class _ColumnView:
    """The nodes of one column: a frame that carries the pose, and in it a shape whose points carry the deformation.

    The pose travels with the world's offset, the points one rendering later: were they to carry the whole motion, a
    body that the camera follows would tremble.
    """

    def __init__(self, server: viser.ViserServer, column: Column, color: Color) -> None:
        self._server, self._column, self._color = server, column, color
        self.root = f"/world/column_{column.key}"
        points = np.asarray(column.geometry.points, dtype=float)
        self._rest, self._centre = points.astype(np.float32), points.mean(axis=0)
        self._size = float(np.ptp(points, axis=0).max())
        self._place = server.scene.add_frame(self.root, show_axes=False)
        self._body = server.scene.add_frame(f"{self.root}/body", show_axes=False)
        self._shape = show_shape(server, f"{self.root}/body", column.geometry, color)
        # a label lags where its own position changes, not where its parent's does
        self._above = server.scene.add_frame(f"{self.root}/above", show_axes=False)
        self._label: viser.LabelHandle | None = None
        self._motion: Motion | RecordedMotion | None = None
        self._spread: tuple[RecordedMotion, Spread] | None = None
        self._as_built = True

    def centre(self, frame: ColumnFrame) -> Floats:
        """(3,) where the rigid part takes the centre of the body."""
        return frame.pose[:3, :3] @ self._centre + frame.pose[:3, 3]

    def moved(self, frame: ColumnFrame) -> Floats:
        """(3,) how far the centre of the body has come."""
        return self.centre(frame) - self._centre

    def hide(self) -> None:
        self._place.visible = False

    def remove(self) -> None:
        self._place.remove()

    def show(
        self, frame: ColumnFrame, place: float, opacity: float | None, truth: ColumnFrame | None, heat: float | None
    ) -> None:
        self._place.visible = True
        self._place.position = (0.0, place, 0.0)
        # turns that cannot be seen are left out, so that a body that falls without turning is a position alone
        step = 0.5 * INVISIBLE / self._size
        self._body.wxyz = np.round(vtf.SO3.from_matrix(frame.pose[:3, :3]).wxyz / step) * step
        self._body.position = frame.pose[:3, 3]
        self._shape.fade(opacity)
        points = self._rest if frame.points is None else frame.points
        if heat is not None and frame.error is not None and truth is not None:
            self._shape.paint(points, self._spread_from(truth)(1e3 * frame.error.distances), heat)
            self._as_built = False
        elif frame.points is not None or not self._as_built:
            self._shape.move(points, frame.covariances)
            self._as_built = frame.points is None

    def _spread_from(self, truth: ColumnFrame) -> Spread:
        record = truth.motion
        assert isinstance(record, RecordedMotion)
        if self._spread is None or self._spread[0] is not record:
            self._spread = (record, Spread(record.geometry.points, self._rest))
        return self._spread[1]

    def title(self, text: str | None, frame: ColumnFrame) -> None:
        if text is not None:
            self._above.position = self.centre(frame)
        if text is None:
            if self._label is not None:
                self._label.remove()
                self._label = None
        elif self._label is None:
            self._label = self._server.scene.add_label(
                f"{self.root}/above/label", text, position=(0.0, 0.0, 0.75 * self._size), anchor="bottom-center"
            )
        elif self._label.text != text:
            self._label.text = text

    def accompany(self, motion: Motion | RecordedMotion) -> None:
        """What only accompanies a motion: its way and its push; sent when the motion is another."""
        if motion is self._motion:
            return
        self._motion = motion
        with self._server.atomic():
            self._show_path(motion)
            if isinstance(motion, Motion):
                self._show_pulse(motion)

    def _show_path(self, motion: Motion | RecordedMotion) -> None:
        """The way of the body's centre over the trained window."""
        window = motion.schema.window
        poses = motion.pose(np.linspace(window.start, window.stop, 61))
        way = poses[:, :3, :3] @ self._centre + poses[:, :3, 3]
        segments = np.stack([way[:-1], way[1:]], axis=1).astype(np.float32)
        self._server.scene.add_line_segments(
            f"{self.root}/path",
            segments,
            colors=np.array(self._color, dtype=np.uint8),
            thickness=2.0,
            thickness_units="screen",
        )

    def _show_pulse(self, motion: Motion) -> None:
        """The push, on the side where it drives the body, as long as it is strong; only scenes with a force have one.

        It acts on the far side, low at the back, where the floor would hide most of an arrow.
        """
        parameters = motion.parameters
        if not {"force", "elevation"} <= set(parameters):
            return
        elevation = parameters["elevation"]
        heading = rotation_z(motion.schema.azimuth(parameters))
        direction = heading @ np.array([np.cos(elevation), 0.0, np.sin(elevation)])
        start = 0.5 * (self._rest.min(axis=0) + self._rest.max(axis=0)) + 0.55 * self._size * direction
        force = next(p for p in motion.schema.parameters if p.name == "force")
        length = self._size * max(parameters["force"], 0.0) / force.high
        shaft = np.array([[start, start + length * direction]], dtype=np.float32)
        self._server.scene.add_arrows(
            f"{self.root}/pulse",
            shaft,
            ARROW,
            shaft_radius=0.02 * self._size,
            head_radius=0.055 * self._size,
            head_length=0.12 * self._size,
        )


class SceneView:
    """Everything in the viewport."""

    def __init__(self, server: viser.ViserServer, extent: float, columns: int) -> None:
        """`extent` is the size of a body in metres, `columns` how many are to be in view at first."""
        self._server, self._size = server, extent
        self._views: dict[int, tuple[Column, _ColumnView]] = {}
        self._still: tuple[Geometry, viser.FrameHandle] | None = None
        self._set_stage(columns)

    def _set_stage(self, columns: int) -> None:
        server, size = self._server, self._size
        wide = 1.0 + 0.45 * (columns - 1)
        server.scene.set_up_direction("+z")
        server.initial_camera.position = (-3.9 * size * wide, -2.6 * size * wide, 1.9 * size * wide)
        # the panel covers the right third of the view: look past the body's right side
        server.initial_camera.look_at = (0.3 * size, -0.45 * size, 0.45 * size)
        server.initial_camera.fov = 0.7
        self._world = server.scene.add_frame("/world", show_axes=False)
        self._floor = server.scene.add_grid(
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

    def publish(self, frame: Frame, looks: DisplayOptions, heat: float | None) -> None:
        """Send one frame, whole: clients never see half of it. What only accompanies a motion follows it.

        Errors against the truth are painted on a scale that ends at `heat` mm.
        """
        with self._server.atomic():
            self._match(frame)
            self._show_still(frame)
            row = [column.key for column in frame.request.columns if column.visible]
            several = len(row) > 1
            for shown in frame.columns:
                view, index = self._views[shown.column.key][1], row.index(shown.column.key)
                # columns stand in a row across the default heading, from left to right
                place = 0.0 if looks.overlay else 1.6 * self._size * (0.5 * (len(row) - 1) - index)
                view.show(shown, place, GHOST if looks.overlay and index else None, frame.truth, heat)
                if self._still is not None and shown.column.fit and shown.column.fit.still is self._still[0]:
                    self._still[1].position = (0.0, place, 0.0)
                view.title(title_of(shown) if several and not looks.overlay else None, shown)
            self._world.position = self._offset(frame, looks)
        self._server.flush()
        for shown in frame.columns:
            self._views[shown.column.key][1].accompany(shown.motion)

    def _match(self, frame: Frame) -> None:
        """A view for each column that is shown, none for those that are gone."""
        requested = {column.key: column for column in frame.request.columns}
        visible = {shown.column.key for shown in frame.columns}
        for key, (column, view) in list(self._views.items()):
            if key not in requested or requested[key].geometry is not column.geometry:
                view.remove()
                del self._views[key]
            elif key not in visible:
                view.hide()
        for shown in frame.columns:
            if shown.column.key not in self._views:
                view = _ColumnView(self._server, shown.column, color_of(shown.column))
                self._views[shown.column.key] = (shown.column, view)

    def _show_still(self, frame: Frame) -> None:
        """What stands still of a shape, sent once, and once for all columns; it brings a floor of its own."""
        # splats on the floor would sink into it by half
        splats = any(isinstance(shown.column.geometry, GaussianSplats) for shown in frame.columns)
        self._floor.position = (0.0, 0.0, -0.01 * self._size if splats else 0.0)
        requested = frame.still
        if requested is (self._still and self._still[0]):
            return
        if self._still is not None:
            self._still[1].remove()
            self._still = None
        if requested is not None:
            self._still = (requested, self._server.scene.add_frame("/world/still", show_axes=False))
            show_shape(self._server, "/world/still", requested, STILL)
        self._floor.visible = requested is None

    def _offset(self, frame: Frame, looks: DisplayOptions) -> tuple[float, float, float]:
        """Following moves the world past the camera, which stays in the user's hand."""
        if not looks.follow or not frame.columns:
            return (0.0, 0.0, 0.0)
        first = frame.columns[0]
        # in steps that cannot be seen, so that it stays where it is while a body falls straight down
        x, y, _ = np.round(self._views[first.column.key][1].moved(first) / INVISIBLE) * INVISIBLE
        return (-float(x), -float(y), 0.0)


def title_of(shown: ColumnFrame) -> str:
    """What stands above a column: its name, its error, and what is wrong."""
    error = f" · {shown.error.rmse_mm:.2f} mm" if shown.error else ""
    sunk = " · below the floor" if shown.below_floor else ""
    return f"{shown.column.label}{error}{sunk}"
