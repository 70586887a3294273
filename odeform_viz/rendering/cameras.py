"""The cameras of the browsers that look at the page."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import viser

from odeform_viz.rendering.framing import Framing, Viewport
from odeform_viz.view import Sight

__all__ = ["Cameras"]

USUAL: Viewport = (1440, 900)
SAME = 1e-4  # m; positions on the wire are rounded


class Cameras:
    """Aims all cameras at once, each for the size of its browser; users turn them freely in between."""

    def __init__(self, server: viser.ViserServer, resized: Callable[[], None]) -> None:
        """`resized` is called when a browser appears or changes its size."""
        self._server, self._resized = server, resized
        self._framing: Framing | None = None
        self._kept: Sight | None = None  # for the next aim
        server.scene.set_up_direction("+z")
        server.on_client_connect(self._connected)

    @property
    def viewport(self) -> Viewport:
        """Size of the largest browser's canvas."""
        sizes = [_size(client) for client in self._server.get_clients().values()]
        return max(sizes, key=lambda size: size[0] * size[1], default=USUAL)

    def close(self) -> None:
        """Aim no camera any more."""
        self._framing = None

    def keep(self, sight: Sight) -> None:
        """Let the next `aim` be at `sight` in the browsers that are there."""
        self._kept = sight

    def aim(self, framing: Framing) -> None:
        """Aim the cameras of all browsers, and of those that connect later."""
        self._framing, kept = framing, self._kept
        self._kept = None
        initial, camera = self._server.initial_camera, framing.camera(self.viewport)
        initial.position, initial.look_at, initial.fov = tuple(camera.position), tuple(camera.look_at), camera.fov
        for client in self._server.get_clients().values():
            _aim(client, framing, kept)

    async def _connected(self, client: viser.ClientHandle) -> None:
        size = _size(client)
        self._resized()
        self._aim_one(client)

        async def moved(_: viser.CameraHandle) -> None:
            nonlocal size
            if _size(client) != size:
                size = _size(client)
                self._resized()
                self._aim_one(client)
            elif self._is_of_another_size(client):
                self._aim_one(client)

        client.camera.on_update(moved)

    def _aim_one(self, client: viser.ClientHandle) -> None:
        if self._framing is not None:
            _aim(client, self._framing)

    def _is_of_another_size(self, client: viser.ClientHandle) -> bool:
        """Whether a browser has the camera that all begin with, and return to by viser's own reset.

        That is for the largest of them, and may reach a slow one after the camera of its own.
        """
        if self._framing is None:
            return False
        framed, initial = self._framing.camera(_size(client)).position, self._server.initial_camera.position
        return bool(
            np.allclose(client.camera.position, initial, atol=SAME) and not np.allclose(framed, initial, atol=SAME)
        )


def _aim(client: viser.ClientHandle, framing: Framing, kept: Sight | None = None) -> None:
    camera = framing.camera(_size(client))
    if kept is not None:
        camera = replace(camera, position=np.array(kept.position), look_at=np.array(kept.look_at))
    with client.atomic():
        # position first: setting it also translates the target
        client.camera.position = camera.position
        client.camera.look_at = camera.look_at
        client.camera.fov = camera.fov


def _size(client: viser.ClientHandle) -> Viewport:
    return client.camera.image_width, client.camera.image_height
