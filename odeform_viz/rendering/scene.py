"""Shows frames in viser's scene: columns on a grid in the plane of the view, or all in one place."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
import viser

from odeform.types import Floats, Mesh, Points, Pose, Vector
from odeform_viz.coloring.scale import colors_of
from odeform_viz.colors import TRUTH, color_of
from odeform_viz.columns import Column
from odeform_viz.obstacles import meets_something
from odeform_viz.pushing import picked
from odeform_viz.rendering.cameras import Cameras
from odeform_viz.rendering.column_view import ColumnView
from odeform_viz.rendering.framing import Axes, Box, Framing, Viewport, frame_columns
from odeform_viz.rendering.lights import Lights
from odeform_viz.rendering.look import Colors, Look
from odeform_viz.rendering.outline import RISE, ceiling_of, direction_of, outline_of, reach_of
from odeform_viz.rendering.push import Pull
from odeform_viz.rendering.stage import Stage
from odeform_viz.rendering.titles import title_of
from odeform_viz.view import INVISIBLE, Coloring, ColumnFrame, DisplayOptions, Frame, Sight

__all__ = ["SceneView"]

ENDED = 0.25  # opacity of a truth that is over


class SceneView:
    """Everything in the viewport."""

    def __init__(
        self,
        server: viser.ViserServer,
        extent: float,
        wake: Callable[[], None],
        pick: Callable[[Column | None, Vector], None] | None = None,
        pull: Pull | None = None,
    ) -> None:
        """`extent` is the size of a body in metres; `wake` asks for the frame again, because a browser was resized.

        `pick` is called with the column that was clicked, and the point (3,) m of its shape at rest; with None for a
        click beside all of them. `pull` is called while the arrow of a force is dragged.
        """
        self._server, self._extent = server, extent
        self._views: dict[int, tuple[Column, ColumnView]] = {}
        self._stage = Stage(server, extent)
        self._cameras = Cameras(server, wake)
        self._pick, self._pull = pick, pull
        self._pickable: tuple[_DrawnBody, ...] = ()
        if pick is not None:
            server.scene.on_click()(self._clicked)  # pyright: ignore[reportArgumentType]
        self._framed: object = None  # what the framing was made for
        self._reaches: WeakKeyDictionary[object, float] = WeakKeyDictionary()  # of motions, in m
        self._ceiling = 0.0  # m above the floor up to which the centres of bodies rise in it
        start = Box(-extent, extent, 0.0, extent)
        self._framing = frame_columns(1, Axes.beside(None), start, extent, self.viewport, together=True, level=False)
        self._lights = Lights(server)

    @property
    def viewport(self) -> Viewport:
        """Size of the largest browser's canvas, in px."""
        return self._cameras.viewport

    def fit(self) -> None:
        """Aim all cameras as they were before users turned them."""
        self._cameras.aim(self._framing)

    def look(self, sight: Sight) -> None:
        """Aim all cameras at `sight` with the next frame, instead of as they are at first."""
        self._cameras.keep(sight)
        self._framed = None

    def close(self) -> None:
        """Leave the cameras of browsers that stay connected to another page."""
        self._cameras.close()

    def publish(self, frame: Frame, options: DisplayOptions, coloring: Coloring | None) -> None:
        """Send one frame, in the bodies' own colors without a `coloring`; clients never see it half.

        Paths and arrows follow it.
        """
        with self._server.atomic():
            row = [column.key for column in frame.request.columns if column.visible]
            together = options.overlay or len(row) < 2
            discs = not together and frame.still is None
            framing = self._frame_columns(frame, row, options, together)
            self._update_views(frame)
            self._stage.show(frame, discs)
            first = next((c for c in frame.columns if c.column.truth is None), None)
            for shown in frame.columns:
                view, index = self._views[shown.column.key][1], row.index(shown.column.key)
                view.stand(framing.offsets[index], framing.stage if discs else None, options.follow, shown)
                values = coloring.values.get(shown.column.key) if coloring else None
                colors = colors_of(view.drawn(values), coloring.scale) if coloring and values is not None else None
                view.show(shown, options, self._look(shown, options, shown is first, colors))
                if shown.column.fit and shown.column.fit.static is not None:
                    self._stage.place_background(shown.column.fit.static, framing.offsets[index])
                view.title(None if together else title_of(shown, framing.title_pixels), framing.title)
            self._stage.shift(self._offset(frame, options, discs))
        self._server.flush()
        for shown in frame.columns:
            self._views[shown.column.key][1].annotate(shown, frame.request.time, options)
        if self._pick is not None:
            self._pickable = tuple(self._drawn_body(shown, options) for shown in frame.columns)

    def _look(self, shown: ColumnFrame, options: DisplayOptions, solid: bool, colors: Colors | None) -> Look:
        """Bodies are of clay; those that overlap, or belong to a sweep, have the colors of their curves.

        Two surfaces in one place would cover each other in patches: of bodies that overlap only one is `solid`, and
        the others are drawn as dots on it.
        """
        if shown.ended:
            return Look(None, ENDED, options.wireframe, TRUTH)
        tint = color_of(shown.column) if options.overlay or shown.column.rank is not None else None
        return Look(colors, None, options.wireframe, tint, dots=options.overlay and not solid)

    def _drawn_body(self, shown: ColumnFrame, options: DisplayOptions) -> "_DrawnBody":
        view = self._views[shown.column.key][1]
        pose = view.placement(shown)
        pose[:3, 3] += self._stage.position
        return _DrawnBody(shown.column, view.points(shown, options), pose)

    async def _clicked(self, event: viser.SceneClickEvent) -> None:
        # a coroutine: clicks are answered in their order
        assert self._pick is not None
        origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
        hits = [hit for body in self._pickable if (hit := body.hit(origin, direction)) is not None]
        _, column, point = min(hits, key=lambda hit: hit[0], default=(0.0, None, np.zeros(3)))
        self._pick(column, point)

    def _frame_columns(self, frame: Frame, row: list[int], options: DisplayOptions, together: bool) -> Framing:
        """Places the columns. The cameras are aimed only when that changes, or the body does, or where two bodies would
        leave their floor."""
        shapes = [id(shown.column.geometry) for shown in frame.columns]
        noted = any(shown.untrained for shown in frame.columns)
        reasons = (row, shapes, together, options.viewport, frame.still is None, options.follow, noted)
        reach = 0.0 if together else max(map(self._reach, frame.columns), default=0.0)
        if frame.columns and (self._framed != reasons or reach > self._framing.stage):
            axes = Axes.beside(direction_of(frame.columns[0]))
            extent, level = max(map(self._size, frame.columns)), frame.still is not None
            travels = together and meets_something(frame.columns[0].motion)
            most = RISE * extent if together and options.follow and not (travels or level) else math.inf
            box = _around([outline_of(c, axes, travels, most) for c in frame.columns])
            self._framing = frame_columns(len(row), axes, box, extent, options.viewport, together, level, noted, reach)
            self._ceiling = max(ceiling_of(c, most) for c in frame.columns)
            self._cameras.aim(self._framing)
            self._lights.aim(self._framing, everywhere=level)
            self._framed = reasons  # last: a request cancelled on the way is framed anew
        return self._framing

    def _reach(self, shown: ColumnFrame) -> float:
        if shown.motion not in self._reaches:
            self._reaches[shown.motion] = reach_of(shown)
        return self._reaches[shown.motion]

    def _size(self, shown: ColumnFrame) -> float:
        """Metres: that of the trained body, or in scenes with several of the one that is shown."""
        if not shown.motion.schema.objects:
            return self._extent
        return float(np.ptp(np.asarray(shown.column.geometry.points), axis=0).max())

    def _update_views(self, frame: Frame) -> None:
        """Make a view for each visible column, hide hidden ones, and remove those of removed columns."""
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
                free = shown.column.predictor is not None and shown.column.pinned is None
                pull = self._pull if free else None
                view = ColumnView(self._server, shown.column, color_of(shown.column), pull, _finest(frame))
                self._views[shown.column.key] = (shown.column, view)

    def _offset(self, frame: Frame, options: DisplayOptions, discs: bool) -> Floats:
        """The shift (3,) of the world, in m, that keeps the first body in front of the camera; downwards where it rises
        higher than what was framed, as after a harder kick. Where there is an obstacle, the body goes there instead."""
        if discs or not options.follow or not frame.columns or meets_something(frame.columns[0].motion):
            return np.zeros(3)
        first = frame.columns[0]
        view = self._views[first.column.key][1]
        moved = np.array([*view.displacement(first)[:2], max(view.centre(first)[2] - self._ceiling, 0.0)])
        # in invisible steps, so that a body that falls straight down within the frame moves nothing
        return -np.round(moved / INVISIBLE) * INVISIBLE


@dataclass(frozen=True, eq=False)
class _DrawnBody:
    """A body as it stands in the viewport."""

    column: Column
    points: Points
    """(N, 3) m, before the pose."""
    pose: Pose
    """(4, 4) to the world of the viewport."""

    def hit(self, origin: Floats, direction: Floats) -> tuple[float, Column, Vector] | None:
        """Describes where a ray meets the body: its distance, the column, and the point (3,) m at rest."""
        turn, shift = self.pose[:3, :3], self.pose[:3, 3]
        found = picked(self.column.geometry, self.points, (origin - shift) @ turn, direction @ turn)
        return None if found is None else (found[1], self.column, found[0])


def _finest(frame: Frame) -> Mesh | None:
    """The finest mesh of a trained body among the predictions."""
    meshes = (c.column.geometry for c in frame.columns if c.column.predictor and not c.column.loaded)
    return max((m for m in meshes if isinstance(m, Mesh)), key=lambda mesh: len(mesh.points), default=None)


def _around(boxes: list[Box]) -> Box:
    """The box around several."""
    return Box(
        min(box.left for box in boxes),
        max(box.right for box in boxes),
        min(box.low for box in boxes),
        max(box.high for box in boxes),
    )
