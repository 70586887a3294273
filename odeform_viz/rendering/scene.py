"""Shows frames in viser's scene: columns side by side under one camera."""

import numpy as np
import viser

from odeform_viz.colors import color_of
from odeform_viz.columns import Column
from odeform_viz.rendering.column_view import ColumnView
from odeform_viz.rendering.stage import Stage
from odeform_viz.view import INVISIBLE, ColumnFrame, DisplayOptions, Frame

__all__ = ["SceneView"]

OVERLAID = 0.45  # opacity of all but the first of columns that overlap
SPACING = 1.6  # between columns, in sizes of the body


class SceneView:
    """Everything in the viewport."""

    def __init__(self, server: viser.ViserServer, extent: float, columns: int) -> None:
        """`extent` is the size of a body in metres; the initial camera shows `columns` of them side by side."""
        self._server, self._extent = server, extent
        self._views: dict[int, tuple[Column, ColumnView]] = {}
        self._stage = Stage(server, extent, columns)

    def publish(self, frame: Frame, options: DisplayOptions, error_scale: float | None) -> None:
        """Send one frame; clients never see it half. Paths and arrows follow it.

        Errors against the truth are colored on a scale up to `error_scale` mm, if given.
        """
        with self._server.atomic():
            self._update_views(frame)
            self._stage.show(frame)
            row = [column.key for column in frame.request.columns if column.visible]
            several = len(row) > 1
            for shown in frame.columns:
                view, index = self._views[shown.column.key][1], row.index(shown.column.key)
                # from left to right as seen from the initial camera
                lane = 0.0 if options.overlay else SPACING * self._extent * (0.5 * (len(row) - 1) - index)
                view.show(shown, lane, OVERLAID if options.overlay and index else None, frame.truth, error_scale)
                if shown.column.fit and shown.column.fit.static is not None:
                    self._stage.place_background(shown.column.fit.static, lane)
                view.title(title_of(shown) if several and not options.overlay else None, shown)
            self._stage.shift(*self._offset(frame, options))
        self._server.flush()
        for shown in frame.columns:
            self._views[shown.column.key][1].annotate(shown.motion)

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
                view = ColumnView(self._server, shown.column, color_of(shown.column))
                self._views[shown.column.key] = (shown.column, view)

    def _offset(self, frame: Frame, options: DisplayOptions) -> tuple[float, float]:
        """The shift of the world, in m, that keeps the first body in front of the camera."""
        if not options.follow or not frame.columns:
            return (0.0, 0.0)
        first = frame.columns[0]
        # in invisible steps, so that a body that falls straight down moves nothing
        x, y, _ = np.round(self._views[first.column.key][1].displacement(first) / INVISIBLE) * INVISIBLE
        return (-float(x), -float(y))


def title_of(shown: ColumnFrame) -> str:
    """The text above a column: its name, its error, and a warning."""
    error = f" · {shown.error.rmse_mm:.2f} mm" if shown.error else ""
    sunk = " · below the floor" if shown.below_floor else ""
    return f"{shown.column.label}{error}{sunk}"
