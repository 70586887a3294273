"""How a shape lies in the scene: guessed, and corrected by hand."""

from collections.abc import Callable

import numpy as np
import viser

from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.types import Rotations
from odeform_viz.panels.callbacks import LOCK, on_user_change, serialized
from odeform_viz.rendering.gizmos import CameraFocus, TransformGizmo

__all__ = ["AlignmentPanel"]

BY_HAND = "by hand"


class AlignmentPanel:
    """Which axis is up, how large, and arrows and rings in the scene; what they say is handed on."""

    def __init__(
        self,
        server: viser.ViserServer,
        hold: Callable[[], None],
        turn: Callable[[Rotations | None], None],
        put: Callable[[Similarity], None],
        changed: Callable[[], None],
    ) -> None:
        """`hold` stops at rest; `turn` fits the shape anew under a rotation, or as guessed; `put` takes a place;
        `changed` is called when arrows and rings come or go."""
        self._hold, self._turn, self._put, self._changed = hold, turn, put, changed
        self._fit: FittedShape | None = None
        self._guess = 1.0
        self._gizmo, self._camera = TransformGizmo(server, self._dragged), CameraFocus(server)
        gui = server.gui
        self._folder = gui.add_folder("Alignment", expand_by_default=False, visible=False)
        with self._folder:
            self._up = gui.add_dropdown("up in the file", (*UPRIGHT, BY_HAND), hint="captures often have -y")
            self._size = gui.add_number("size (%)", 100.0, min=1.0, step=0.5, hint="of the trained body's")
            self._drag = gui.add_checkbox(
                "arrows and rings", False, hint="drag the shape at rest; it follows on release"
            )
            back = gui.add_button("Reset alignment", color="gray", hint="to the trained size, on the floor")
        on_user_change(self._up, self._upright)
        on_user_change(self._size, self._scale)
        on_user_change(self._drag, self._toggled)
        back.on_click(serialized(lambda: self._turn(None)))

    def show(self, fit: FittedShape | None, guess: float) -> None:
        """How a shape lies, None for the body that was trained; and the factor that was guessed."""
        self._fit, self._guess = fit, guess
        self._folder.visible = fit is not None
        if fit is None:
            self._drag.value = False
        else:
            named = (name for name, turn in UPRIGHT.items() if np.allclose(turn, fit.transform.rotation))
            self._up.value = next(named, BY_HAND)
            self._size.value = round(100.0 * fit.transform.factor / guess, 2)
        self._show_gizmo()

    @property
    def dragging(self) -> bool:
        """Whether arrows and rings are on show."""
        return self._gizmo.visible

    def _toggled(self) -> None:
        self._show_gizmo()
        self._changed()

    def _show_gizmo(self) -> None:
        if self._fit is not None and self._drag.value:
            self._hold()
            appears = not self._gizmo.visible
            self._gizmo.show(self._fit)
            if not appears:
                return  # the view may have been turned to reach another ring
            points = np.asarray(self._fit.geometry.points, dtype=float)
            low, high = points.min(axis=0), points.max(axis=0)
            self._camera.look_at(0.5 * (low + high), 1.2 * float((high - low).max()))
        else:
            self._gizmo.hide()
            self._camera.restore()

    def _upright(self) -> None:
        if self._up.value in UPRIGHT:
            self._turn(UPRIGHT[self._up.value])

    def _scale(self) -> None:
        """About the foot of what moves, which keeps it on the floor."""
        size = float(self._size.value)
        if self._fit is None or not (np.isfinite(size) and size > 0.0):
            return
        points = np.asarray(self._fit.geometry.points, dtype=float)
        low, high = points.min(axis=0), points.max(axis=0)
        foot = np.array([*(0.5 * (low + high))[:2], low[2] - self._fit.lift])
        more = 0.01 * size * self._guess / self._fit.transform.factor
        self._put(Similarity(more, np.eye(3), (1.0 - more) * foot) @ self._fit.transform)

    def _dragged(self, motion: Similarity) -> None:
        with LOCK:
            if self._fit is not None:
                self._put(motion @ self._fit.transform)
