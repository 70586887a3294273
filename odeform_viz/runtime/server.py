"""viser's server on a given port, with the page's theme, safe to use from any thread."""

import asyncio
import contextlib
import io
import socket
import sys

import viser

from odeform.errors import InputError
from odeform_viz.colors import HANDLE

__all__ = ["open_server", "stop_server"]

SWITCH_INTERVAL = 2e-4  # s after which a waiting thread gets the GIL


class _LoopEvent(asyncio.Event):
    """An event that only the event loop can set.

    viser 1.1 sets the event of its outgoing messages from any thread, which iterates over the loop's waiters while they
    change ("deque mutated during iteration"), and then again on the loop, which is enough.
    """

    def set(self) -> None:
        with contextlib.suppress(RuntimeError):  # no loop runs on this thread
            asyncio.get_running_loop()
            super().set()


def open_server(host: str, port: int, title: str) -> viser.ViserServer:
    """Start a server. `InputError` if the port cannot be used; port 0 takes a free one."""
    _require_free(host, port)
    # a worker's many short numpy calls would keep the GIL from the socket's thread for 5 ms at a time
    sys.setswitchinterval(SWITCH_INTERVAL)
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a banner
        server = viser.ViserServer(host=host, port=port, verbose=False)
    server._websock_server.get_message_buffer().message_event = _LoopEvent()
    server.gui.configure_theme(
        titlebar_content=None,
        control_width="medium",
        show_logo=False,
        show_share_button=False,
        brand_color=HANDLE,
    )
    server.gui.set_panel_label(title)
    return server


def stop_server(server: viser.ViserServer) -> None:
    """Stop a server; clients lose their connection."""
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a line
        server.stop()


def _require_free(host: str, port: int) -> None:
    """Refuse a port in use: viser would silently take the next one."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except (OSError, OverflowError) as error:
            raise InputError(f"port {port} on {host} cannot be used ({error}); choose another with --port") from None
