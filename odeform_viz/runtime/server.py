"""viser's server: on the port that was asked for or none, in our dress, and safe to talk to from any thread."""

import asyncio
import contextlib
import io
import socket
import sys

import viser

from odeform.errors import InputError

__all__ = ["open_server"]

SWITCH = 2e-4  # s after which a thread that waits for the interpreter gets it


class _LoopEvent(asyncio.Event):
    """Set on the event loop alone.

    viser 1.1 sets the event of its outgoing messages from whatever thread has one, which iterates over the loop's
    waiters as they change ("deque mutated during iteration"), and then again on the loop, which is all it takes.
    """

    def set(self) -> None:
        with contextlib.suppress(RuntimeError):  # no loop runs on this thread
            asyncio.get_running_loop()
            super().set()


def open_server(host: str, port: int, title: str) -> viser.ViserServer:
    """`InputError` for a port that is taken."""
    _require_free(host, port)
    # a worker's many short numpy calls would keep the interpreter from the socket's thread for 5 ms at a time
    sys.setswitchinterval(SWITCH)
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a banner of its own
        server = viser.ViserServer(host=host, port=port, verbose=False)
    server._websock_server.get_message_buffer().message_event = _LoopEvent()
    server.gui.configure_theme(
        titlebar_content=None,
        control_width="medium",
        show_logo=False,
        show_share_button=False,
        brand_color=(214, 96, 48),
    )
    server.gui.set_panel_label(title)
    return server


def _require_free(host: str, port: int) -> None:
    """Viser would silently take the next port."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except (OSError, OverflowError) as error:
            raise InputError(f"port {port} on {host} cannot be used ({error}); choose another with --port") from None
