"""The scene nodes of one column: its body, its title, its path and the arrows of its parameters."""

import numpy as np
import viser
import viser.transforms as vtf

from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.types import Floats
from odeform_viz.colors import Color
from odeform_viz.columns import Column
from odeform_viz.rendering.error_colors import NearestInterpolation
from odeform_viz.rendering.glyphs import GlyphView
from odeform_viz.rendering.path import show_path
from odeform_viz.rendering.shapes import show_shape
from odeform_viz.view import INVISIBLE, ColumnFrame

__all__ = ["ColumnView"]


class ColumnView:
    """A frame that carries the rigid pose, and in it a shape whose points carry the deformation.

    The browser applies a pose together with the offset of the world, but new points one rendering later: if the points
    carried the whole motion, a body that the camera follows would jitter.
    """

    def __init__(self, server: viser.ViserServer, column: Column, color: Color) -> None:
        self._server, self._column, self._color = server, column, color
        self.root = f"/world/column_{column.key}"
        points = np.asarray(column.geometry.points, dtype=float)
        self._rest, self._centre = points.astype(np.float32), points.mean(axis=0)
        self._extent = float(np.ptp(points, axis=0).max())
        self._lane = server.scene.add_frame(self.root, show_axes=False)
        self._body = server.scene.add_frame(f"{self.root}/body", show_axes=False)
        self._shape = show_shape(server, f"{self.root}/body", column.geometry, color)
        # the title's own position would lag behind the body; that of its parent does not
        self._above = server.scene.add_frame(f"{self.root}/above", show_axes=False)
        self._glyphs = GlyphView(server, self.root, self._rest)
        self._label: viser.LabelHandle | None = None
        self._motion: Motion | RecordedMotion | None = None
        self._interpolation: tuple[RecordedMotion, NearestInterpolation] | None = None
        self._undeformed = True

    @property
    def lane(self) -> float:
        """Metres along y by which the column stands beside the others."""
        return float(self._lane.position[1])

    def centre(self, frame: ColumnFrame) -> Floats:
        """(3,) m: where the pose takes the centre of the body."""
        return frame.pose[:3, :3] @ self._centre + frame.pose[:3, 3]

    def displacement(self, frame: ColumnFrame) -> Floats:
        """(3,) m: how far the centre of the body has moved."""
        return self.centre(frame) - self._centre

    def hide(self) -> None:
        """Hide the column until it is shown again."""
        self._lane.visible = False

    def remove(self) -> None:
        """Remove all nodes of the column."""
        self._lane.remove()

    def show(
        self,
        frame: ColumnFrame,
        lane: float,
        opacity: float | None,
        truth: ColumnFrame | None,
        error_scale: float | None,
    ) -> None:
        """Show one moment at `lane`, metres along y. Errors are colored on a scale up to `error_scale` mm, if given."""
        self._lane.visible = True
        self._lane.position = (0.0, lane, 0.0)
        # invisible rotations are dropped, so that a body that falls without rotating sends a position only
        step = 0.5 * INVISIBLE / self._extent
        self._body.wxyz = np.round(vtf.SO3.from_matrix(frame.pose[:3, :3]).wxyz / step) * step
        self._body.position = frame.pose[:3, 3]
        self._shape.fade(opacity)
        points = self._rest if frame.points is None else frame.points
        if error_scale is not None and frame.error is not None and truth is not None:
            self._shape.paint(points, self._interpolate(truth, 1e3 * frame.error.distances), error_scale)
            self._undeformed = False
        elif frame.points is not None or not self._undeformed:
            self._shape.move(points, frame.covariances)
            self._undeformed = frame.points is None

    def _interpolate(self, truth: ColumnFrame, values: Floats) -> Floats:
        """Values at the truth's vertices (N,), carried to the points (M,) of this column."""
        record = truth.motion
        assert isinstance(record, RecordedMotion)
        if self._interpolation is None or self._interpolation[0] is not record:
            self._interpolation = (record, NearestInterpolation(record.geometry.points, self._rest))
        return self._interpolation[1](values)

    def title(self, text: str | None, frame: ColumnFrame) -> None:
        """Show a text above the body; None for no text."""
        if text is not None:
            self._above.position = self.centre(frame)
        if text is None:
            if self._label is not None:
                self._label.remove()
                self._label = None
        elif self._label is None:
            self._label = self._server.scene.add_label(
                f"{self.root}/above/label", text, position=(0.0, 0.0, 0.75 * self._extent), anchor="bottom-center"
            )
        elif self._label.text != text:
            self._label.text = text

    def annotate(self, motion: Motion | RecordedMotion) -> None:
        """Draw what belongs to a whole motion, its path and its arrows; sent only when the motion changes."""
        if motion is self._motion:
            return
        self._motion = motion
        with self._server.atomic():
            show_path(self._server, self.root, motion, self._centre, self._color)
            if isinstance(motion, Motion):
                self._glyphs.show(motion.schema.scene, motion.parameters)
