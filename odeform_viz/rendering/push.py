"""The sphere that pushes a body, its force as an arrow that can be dragged, and the contact on the surface."""

from collections.abc import Callable

import numpy as np
import viser

from odeform.types import Floats, Points, Pose, Vector
from odeform_viz.colors import CONTACT, HANDLE, SPHERE, Color, paler
from odeform_viz.pushing import ShownPush

__all__ = ["Pull", "PushView"]

Pull = Callable[[ShownPush, Vector, str], None]
"""Called while the arrow's tail is dragged: the push as it was, where the tail is (3,) m, and the phase of the drag
("start", "update" or "end")."""
MARKER, HANDLE_SIZE = 0.022, 0.035  # radius of the contact's marker and of the arrow's handle, in sizes of the body
SMALLEST = 1e-3  # m, of a sphere that is never drawn
SHAFT, HEAD, POINT = 0.016, 0.045, 0.1  # radii and the head's length, likewise


class PushView:
    """The sphere and the arrow move with the surface while they act; afterwards the arrow is pale, where it began."""

    def __init__(self, server: viser.ViserServer, ground: str, body: str, pull: Pull | None) -> None:
        """`ground` and `body` are scene nodes: of the floor under a column, and of its body. Without `pull`, the arrow
        cannot be dragged."""
        self._scene, self._ground, self._body, self._pull = server.scene, ground, body, pull
        self._push: ShownPush | None = None
        self._nodes: _Nodes | None = None
        self._acting: bool | None = None
        self._grabbed: tuple[ShownPush, Floats] | None = None

    def show(self, push: ShownPush, time: float, points: Points, pose: Pose, left: bool = False) -> None:
        """Show a push at `time` s, when the shape is drawn with points (N, 3) m that `pose` (4, 4) moves. Once a body
        has `left` the place, nothing is drawn there after the push."""
        if self._nodes is None:
            self._nodes = _Nodes(self._scene, self._ground, self._body, push)
            if self._pull is not None:
                self._nodes.handle.on_drag(self._dragged)
            self._nodes.handle.visible = self._pull is not None
        contact, acting = push.contact(points), push.acts(time)
        self._nodes.marker.position = contact
        self._nodes.place.visible = acting or not left
        self._nodes.place.position = push.shift(pose[:3, :3] @ contact + pose[:3, 3]) if acting else np.zeros(3)
        if push is not self._push or acting != self._acting:
            self._push, self._acting = push, acting
            self._nodes.show(push, acting)

    async def _dragged(self, event: viser.SceneNodeDragEvent) -> None:
        # a coroutine: the phases of a drag arrive in order
        if self._pull is None or self._push is None or self._nodes is None:
            return
        if event.phase == "start":
            self._grabbed = self._push, np.subtract(event.start_position, self._nodes.handle.position)
        if self._grabbed is not None:
            push, origin = self._grabbed
            self._pull(push, np.subtract(event.end_position, origin), event.phase)
        if event.phase == "end":
            self._grabbed = None


class _Nodes:
    """The scene nodes of a push. The contact's marker is a part of the body; all else stands on the ground."""

    def __init__(self, scene: viser.SceneApi, ground: str, body: str, push: ShownPush) -> None:
        self._scene, self._root = scene, f"{ground}/push"
        self.place = scene.add_frame(self._root, show_axes=False)
        self.marker = scene.add_icosphere(f"{body}/contact", 1.0, CONTACT, subdivisions=2, cast_shadow=False)
        self.sphere = scene.add_icosphere(
            f"{self._root}/sphere", max(push.contacts.radius, SMALLEST), SPHERE, subdivisions=4, receive_shadow=False
        )
        self.handle = scene.add_icosphere(f"{self._root}/handle", 1.0, HANDLE, subdivisions=2, cast_shadow=False)
        self.label = scene.add_label(f"{self._root}/label", "", anchor="bottom-center")
        self._arrow: viser.ArrowsHandle | None = None

    def show(self, push: ShownPush, acting: bool) -> None:
        """Place everything as at time 0."""
        tail, head = push.arrow
        self.marker.scale = MARKER * push.size
        self.sphere.position, self.sphere.visible = push.centre, acting and push.contacts.radius > 0.0
        self.handle.position, self.handle.scale = tail, HANDLE_SIZE * push.size
        self.label.position = tail + np.array([0.0, 0.0, HANDLE_SIZE * push.size])
        text = f"{push.push.strength:.3g} N" + ("" if acting else f"\nuntil {push.contacts.pulse:.2g} s")
        if self.label.text != text:
            self.label.text = text
        self._show_arrow(push, tail, head, HANDLE if acting else paler(HANDLE))

    def _show_arrow(self, push: ShownPush, tail: Floats, head: Floats, color: Color) -> None:
        length = float(np.linalg.norm(head - tail))
        if length < 1e-6:
            if self._arrow is not None:
                self._arrow.remove()
                self._arrow = None
            return
        self._arrow = self._scene.add_arrows(  # it replaces the one before
            f"{self._root}/arrow",
            np.array([[tail, head]], dtype=np.float32),
            color,
            shaft_radius=SHAFT * push.size,
            head_radius=HEAD * push.size,
            head_length=min(POINT * push.size, 0.6 * length),
        )
