"""Shows where x, y and z point, in a corner of the view, where sliders name them."""

import json

import numpy as np
import viser
from viser.transforms import SO3

from odeform.schema import Schema
from odeform_viz.browser.scripts import run_script
from odeform_viz.page import Page, Panel
from odeform_viz.pushing import contacts_of

__all__ = ["AxesPanel", "axes_script", "names_axes"]

HIDDEN = "window.odeform?.showAxes?.(null)"


def names_axes(schema: Schema) -> bool:
    """Whether sliders of a scene name x, y or z, or an angle from one of them. Contacts are clicked instead."""
    named = any(p.name[-2:] in ("_x", "_y", "_z") or p.role == "azimuth" for p in schema.parameters)
    return named and contacts_of(schema) is None


def axes_script(camera: SO3) -> str:
    """Draws the axes as a camera sees them that is turned like that: z of a camera is away from it, y is down.

    The script is told, for x, y and z, how far each goes to the right, down and away.
    """
    seen = np.round(camera.as_matrix(), 2) + 0.0  # no -0
    return f"(window.odeform ??= {{}}).axes = {json.dumps(seen.tolist())}; window.odeform.showAxes?.(odeform.axes)"


class AxesPanel(Panel):
    """Three lines with letters, which turn with the camera of each browser."""

    @classmethod
    def needed(cls, page: Page) -> bool:
        return names_axes(page.schema)

    def __init__(self, page: Page) -> None:
        self._server, self._closed = page.server, False
        page.server.on_client_connect(self._connected)

    def close(self) -> None:
        self._closed = True
        for client in self._server.get_clients().values():
            run_script(client, HIDDEN)

    async def _connected(self, client: viser.ClientHandle) -> None:
        sent = ""

        async def turned(camera: viser.CameraHandle) -> None:
            nonlocal sent
            script = axes_script(SO3(np.asarray(camera.wxyz)))
            if script != sent and not self._closed:
                sent = script
                run_script(client, script)

        client.camera.on_update(turned)
        await turned(client.camera)
