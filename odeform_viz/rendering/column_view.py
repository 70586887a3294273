"""The scene nodes of one column: its body, its title, its path and the arrows of its parameters."""

import numpy as np
import viser
import viser.transforms as vtf

from odeform.loads.registry import first_body, meets_twin
from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.types import Floats, GaussianSplats, Mesh, Perpoint, Points, Pose
from odeform_viz.colors import Color
from odeform_viz.columns import Column
from odeform_viz.pushing import ShownPush, push_shown
from odeform_viz.rendering.disc import FloorDisc
from odeform_viz.rendering.ghost import show_ghost
from odeform_viz.rendering.glyphs import GlyphView
from odeform_viz.rendering.look import Look
from odeform_viz.rendering.nodes import add_place
from odeform_viz.rendering.obstacles import ObstacleView
from odeform_viz.rendering.path import show_path
from odeform_viz.rendering.push import Pull, PushView
from odeform_viz.rendering.refined import refined
from odeform_viz.rendering.shadow import FloorShadow
from odeform_viz.rendering.shapes import show_shape
from odeform_viz.view import INVISIBLE, ColumnFrame, DisplayOptions

__all__ = ["ColumnView"]

LEFT = 0.35  # of the radius of its floor: a body that has moved farther has left where it was pushed


class ColumnView:
    """A frame that carries the rigid pose, and in it a shape whose points carry the deformation.

    The browser applies a pose together with the offset of the world, but new points one rendering later: if the points
    carried the whole motion, a body that the camera follows would jitter.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        column: Column,
        color: Color,
        pull: Pull | None = None,
        fine: Mesh | None = None,
    ) -> None:
        """`pull` is called while the arrow of a force is dragged; None: it cannot be.

        A truth is drawn as finely as `fine`, if that is a mesh of the same body.
        """
        self._server, self._geometry, self._color = server, column.geometry, color
        self.root = f"/world/column_{column.key}"
        points = np.asarray(column.geometry.points, dtype=float)
        scene = column.source.schema.scene
        self._first, self._pair = first_body(scene, len(points)), meets_twin(scene)
        first = points[self._first]
        self._rest, self._centre = points.astype(np.float32), first.mean(axis=0)
        self._extent = float(np.ptp(points, axis=0).max())
        self._place = add_place(server, self.root)
        # what lies on the floor moves with it, past a body that is followed
        self._ground = add_place(server, f"{self.root}/ground")
        self._body = add_place(server, f"{self.root}/body")
        on_floor = column.fit is None or column.fit.static is None  # a captured scene has shadows of its own
        coarse = column.geometry if column.truth and isinstance(column.geometry, Mesh) else None
        self._refined = refined(coarse, fine) if coarse and fine else None
        drawn = self._refined.mesh if self._refined else column.geometry
        self._shape = show_shape(server, f"{self.root}/body", drawn, color, shadow=on_floor)
        self._shadow = None
        if not on_floor and isinstance(column.geometry, GaussianSplats):
            self._shadow = FloorShadow(server, f"{self.root}/ground/shadow", self._rest)
        self._glyphs = GlyphView(server, f"{self.root}/ground", first.astype(np.float32))
        self._obstacles = ObstacleView(server, f"{self.root}/ground")
        self._push_view = PushView(server, f"{self.root}/ground", f"{self.root}/body", pull)
        self._push: ShownPush | None = None
        self._disc: FloorDisc | None = None
        self._path: viser.LineSegmentsHandle | None = None
        self._path_visible = True
        self._drawn: Motion | RecordedMotion | None = None  # whose path is drawn
        self._label: viser.LabelHandle | None = None
        self._motion: Motion | RecordedMotion | None = None
        self._ghost: viser.SceneNodeHandle | None = None
        self._shift = np.zeros(3)

    @property
    def offset(self) -> Floats:
        """(3,) m: where the column stands."""
        return np.asarray(self._place.position)

    def centre(self, frame: ColumnFrame) -> Floats:
        """(3,) m: where the pose takes the centre of the body; of two, the middle between them."""
        points = self._rest if frame.points is None else frame.points
        centre = points.mean(axis=0, dtype=float) if self._pair else self._centre
        return frame.pose[:3, :3] @ centre + frame.pose[:3, 3]

    def displacement(self, frame: ColumnFrame) -> Floats:
        """(3,) m: how far the centre of the body has moved; of two, where it is, since they rest in one place."""
        return self.centre(frame) - (0.0 if self._pair else self._centre)

    def hide(self) -> None:
        """Hide the column until it is shown again."""
        self._place.visible = False

    def remove(self) -> None:
        """Remove all nodes of the column."""
        self._place.remove()

    def stand(self, offset: Floats, stage: float | None, follow: bool, frame: ColumnFrame) -> None:
        """Place the column at `offset` (3,) m, on a disc of radius `stage` m or on the floor of all (None).

        With a disc the floor passes under a body that is followed; without one the whole world does.
        """
        self._place.visible = True
        self._place.position = offset
        if self._disc is not None and self._disc.radius != stage:
            self._disc.remove()
            self._disc = None
        if self._disc is None and stage is not None:
            self._disc = FloorDisc(self._server, self.root, stage, self._color)
        self._shift = np.zeros(3)
        if self._disc is not None and follow:
            # in invisible steps, so that a body that falls straight down moves nothing
            self._shift[:2] = -np.round(self.displacement(frame)[:2] / INVISIBLE) * INVISIBLE
            self._disc.scroll(*self._shift[:2])
        self._ground.position = self._shift
        # a path would run across the neighbours
        self._path_visible = stage is None
        if self._path is not None:
            self._path.visible = self._path_visible

    def show(self, frame: ColumnFrame, options: DisplayOptions, look: Look) -> None:
        """Show one moment."""
        # invisible rotations are dropped, so that a body that falls without rotating sends a position only
        step = 0.5 * INVISIBLE / self._extent
        self._body.wxyz = np.round(vtf.SO3.from_matrix(frame.pose[:3, :3]).wxyz / step) * step
        # a tenth of that for the position: what stays is nothing on the wire, and a slow body still moves evenly
        fine = 0.1 * INVISIBLE
        self._body.position = np.round((frame.pose[:3, 3] + self._shift) / fine) * fine
        if self._shadow is not None:
            self._shadow.show(self.centre(frame))
        points = self._deformed(frame, options.exaggeration)
        if self._refined is not None and points is not None:
            points = self._refined.points(points)
        self._shape.show(points, frame.covariances, look)
        self._show_ghost(options.ghost)

    def drawn(self, values: Perpoint) -> Perpoint:
        """(M,) values at the vertices that are drawn, for those (N,) of the column's body."""
        return values if self._refined is None else self._refined.values(values)

    def _deformed(self, frame: ColumnFrame, exaggeration: float) -> Points | None:
        """The body before its pose, (N, 3) m; None at rest."""
        if frame.points is None or exaggeration == 1.0:
            return frame.points
        return self._rest + np.float32(exaggeration) * (frame.points - self._rest)

    def _show_ghost(self, visible: bool) -> None:
        if visible and self._ghost is None:
            self._ghost = show_ghost(self._server, f"{self.root}/body/ghost", self._geometry)
        if self._ghost is not None:
            self._ghost.visible = visible

    def title(self, text: str | None, position: Floats) -> None:
        """Show a text under `position` (3,) m from where the column stands; None for no text."""
        if text is None:
            if self._label is not None:
                self._label.remove()
                self._label = None
            return
        if self._label is None:
            self._label = self._server.scene.add_label(f"{self.root}/title", text, anchor="top-center")
        self._label.position = position
        if self._label.text != text:
            self._label.text = text

    def annotate(self, frame: ColumnFrame, time: float, options: DisplayOptions) -> None:
        """Draw the path of a motion, sent only when it changes, and what acts on the body at `time` s."""
        motion = frame.motion
        if motion is not self._motion:
            self._motion, self._push = motion, push_shown(frame.column, motion)
        # a pushed body moves by less than its size, and its path would take longer than its motion
        if self._push is None and self._path_visible and self._drawn is not motion:
            self._drawn = motion
            # not in `atomic`, which would hold back the frame until the path is computed
            self._path = show_path(self._server, f"{self.root}/ground", motion, self._centre, self._color)
        with self._server.atomic():
            self._obstacles.show(motion)
            if self._push is not None:
                # beside others, what stands on a floor that passes by would come to lie over the next body
                left = self._disc is not None and float(np.hypot(*self._shift[:2])) > LEFT * self._disc.radius
                self._push_view.show(self._push, time, self.points(frame, options), frame.pose, left)
            elif isinstance(motion, Motion):
                alone = self._disc is None  # beside others a label would lie over the next body
                points, scene = self.points(frame, options), motion.schema.scene
                self._glyphs.show(scene, motion.parameters, time, points[self._first], frame.pose, labels=alone)

    def points(self, frame: ColumnFrame, options: DisplayOptions) -> Points:
        """(N, 3) m: the body as it is drawn, before its pose."""
        points = self._deformed(frame, options.exaggeration)
        return self._rest if points is None else points

    def placement(self, frame: ColumnFrame) -> Pose:
        """(4, 4): the pose of the body in the world's node, as it is drawn."""
        pose = np.array(frame.pose)
        pose[:3, 3] += self.offset + self._shift
        return pose
