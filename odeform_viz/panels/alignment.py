"""How a loaded shape lies in the scene: fitted automatically, and adjusted by the user."""

from collections.abc import Callable

import numpy as np
import viser

from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.types import Rotations
from odeform_viz.browser.limits import set_limits
from odeform_viz.panels.callbacks import LOCK, on_user_change, serialized
from odeform_viz.rendering.gizmos import CameraFocus, TransformGizmo

__all__ = ["Alignment"]

MANUAL = "as rotated"
SIZES = (1.0, 10_000.0)  # %


class Alignment:
    """Up axis, size and a gizmo for a shape; changes are handed to the shape panel."""

    def __init__(
        self,
        server: viser.ViserServer,
        rest: Callable[[], None],
        rotate: Callable[[Rotations | None], None],
        transform: Callable[[Similarity], None],
        changed: Callable[[], None],
    ) -> None:
        """`rest` pauses before the motion; `rotate` fits the shape again under a rotation, None for the automatic one;
        `transform` places the shape; `changed` is called when the gizmo appears or disappears."""
        self._rest, self._rotate, self._transform, self._changed = rest, rotate, transform, changed
        self._fit: FittedShape | None = None
        self._automatic_scale = 1.0
        self._gizmo, self._camera = TransformGizmo(server, self._dragged), CameraFocus(server)
        gui = server.gui
        self._folder = gui.add_folder("Alignment", expand_by_default=False, visible=False)
        with self._folder:
            self._up = gui.add_dropdown("up axis", (*UPRIGHT, MANUAL), hint="of the file; for captures often -y")
            self._size = gui.add_number("size (%)", 100.0, step=0.5, hint="relative to the trained body")
            set_limits(server, self._size, *SIZES)
            self._drag = gui.add_checkbox("show gizmo", False, hint="drag arrows and rings to move and rotate")
            reset = gui.add_button("Reset alignment", color="gray", hint="to the trained size, on the floor")
        on_user_change(self._up, self._set_up_axis)
        on_user_change(self._size, self._set_size)
        on_user_change(self._drag, self._toggled)
        reset.on_click(serialized(lambda: self._rotate(None)))

    def show(self, fit: FittedShape | None, automatic_scale: float) -> None:
        """Show how a shape lies, None for the trained body; `automatic_scale` is the scale of 100 %."""
        self._fit, self._automatic_scale = fit, automatic_scale
        self._folder.visible = fit is not None
        if fit is None:
            self._drag.value = False
        else:
            axes = (name for name, rotation in UPRIGHT.items() if np.allclose(rotation, fit.transform.rotation))
            self._up.value = next(axes, MANUAL)
            self._size.value = round(100.0 * fit.transform.factor / automatic_scale, 2)
        self._show_gizmo()

    @property
    def dragging(self) -> bool:
        """Whether the gizmo is visible."""
        return self._gizmo.visible

    def _toggled(self) -> None:
        self._show_gizmo()
        self._changed()

    def _show_gizmo(self) -> None:
        if self._fit is None or not self._drag.value:
            self._gizmo.hide()
            self._camera.restore()
            return
        self._rest()
        appears = not self._gizmo.visible
        self._gizmo.show(self._fit)
        if appears:  # afterwards the camera is the user's, who may turn it to reach another ring
            points = np.asarray(self._fit.geometry.points, dtype=float)
            low, high = points.min(axis=0), points.max(axis=0)
            self._camera.look_at(0.5 * (low + high), 1.2 * float((high - low).max()))

    def _set_up_axis(self) -> None:
        if self._up.value in UPRIGHT:
            self._rotate(UPRIGHT[self._up.value])

    def _set_size(self) -> None:
        """Scale about the foot of the moving part, which keeps it on the floor."""
        size = float(self._size.value)
        if self._fit is None:
            return
        if not SIZES[0] <= size <= SIZES[1]:  # by the box's own arrows; typed sizes are refused in words
            self._size.value = round(100.0 * self._fit.transform.factor / self._automatic_scale, 2)
            return
        points = np.asarray(self._fit.geometry.points, dtype=float)
        low, high = points.min(axis=0), points.max(axis=0)
        foot = np.array([*(0.5 * (low + high))[:2], low[2] - self._fit.lift])
        ratio = 0.01 * size * self._automatic_scale / self._fit.transform.factor
        self._transform(Similarity(ratio, np.eye(3), (1.0 - ratio) * foot) @ self._fit.transform)

    def _dragged(self, motion: Similarity) -> None:
        with LOCK:
            if self._fit is not None:
                self._transform(motion @ self._fit.transform)
