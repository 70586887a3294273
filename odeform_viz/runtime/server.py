"""viser's server on a given port, with the page's theme, safe to use from any thread."""

import asyncio
import contextlib
import http
import io
import socket
import sys
import threading
from collections.abc import Iterator
from typing import Any

import viser
import websockets.asyncio.server as websockets_server
from viser._messages import GetRenderRequestMessage
from viser.infra import WebsockMessageHandler

from odeform.errors import InputError
from odeform_viz.colors import HANDLE
from odeform_viz.runtime.access import Access

__all__ = ["clear_page", "open_server", "set_theme", "stop_server"]

SWITCH_INTERVAL = 2e-4  # s after which a waiting thread gets the GIL
STARTING = threading.Lock()


class _LoopEvent(asyncio.Event):
    """An event that only the event loop can set.

    viser 1.1 sets the event of its outgoing messages from any thread, which iterates over the loop's waiters while they
    change ("deque mutated during iteration"), and then again on the loop, which is enough.
    """

    def set(self) -> None:
        with contextlib.suppress(RuntimeError):  # no loop runs on this thread
            asyncio.get_running_loop()
            super().set()


def open_server(access: Access, port: int, title: str) -> viser.ViserServer:
    """Start a server that answers what `access` allows. `InputError` if the port cannot be used; 0 takes a free one."""
    _require_free(access.host, port)
    # a worker's many short numpy calls would keep the GIL from the socket's thread for 5 ms at a time
    sys.setswitchinterval(SWITCH_INTERVAL)
    with contextlib.redirect_stdout(io.StringIO()), _guarded(access):  # viser prints a banner
        server = viser.ViserServer(host=access.host, port=port, verbose=False)
    _send_from_any_thread(server._websock_server)
    server._websock_server.on_client_connect(_send_from_any_thread)
    set_theme(server.gui)
    server.gui.set_panel_label(title)
    return server


def _send_from_any_thread(sender: WebsockMessageHandler) -> None:
    """Mend the messages to all clients, or those to a client that has just connected and hears nothing yet."""
    sender.get_message_buffer().message_event = _LoopEvent()


def set_theme(gui: viser.GuiApi, dark: bool = False) -> None:
    """Set the theme of the page, of all clients or of one."""
    gui.configure_theme(
        titlebar_content=None,
        control_width="medium",
        dark_mode=dark,
        show_logo=False,
        show_share_button=False,
        brand_color=HANDLE,
    )


@contextlib.contextmanager
def _guarded(access: Access) -> Iterator[None]:
    """The server that starts meanwhile refuses what `access` does not allow, before it sends anything.

    viser 1.1 has no option for that. It calls websockets' `serve` while it is constructed, on a thread of its own.
    """
    guarded = []

    def serve(*args: Any, process_request: Any, **more: Any) -> Any:
        def process(connection: websockets_server.ServerConnection, request: Any) -> Any:
            why = access.refusal(request.headers.get_all("Host"), request.headers.get_all("Origin"))
            if why:
                return connection.respond(http.HTTPStatus.FORBIDDEN, f"{why}\n")
            return process_request(connection, request)

        guarded.append(access)
        return original(*args, process_request=process, **more)

    with STARTING:
        original = websockets_server.serve
        websockets_server.serve = serve  # pyright: ignore[reportAttributeAccessIssue]
        try:
            yield
        finally:
            websockets_server.serve = original
    if not guarded:
        raise RuntimeError("viser started its server in an unknown way, without a check of Host and Origin")


@contextlib.contextmanager
def clear_page(server: viser.ViserServer) -> Iterator[None]:
    """Take the page away, of which nothing is written any more, and no longer call what it registered for clients that
    come and go; the next page is built within this context.

    A client of viser 1.1 applies the updates of controls after all else that it handles at once, so that one which was
    busy would look for controls that are gone. It handles a request for a picture by itself: what was sent before is
    done before what is sent after it.
    """
    server._client_connect_cb.clear()
    server._client_disconnect_cb.clear()
    request = GetRenderRequestMessage("image/jpeg", 32, 32, 1, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, "odeform")
    server.gui._websock_interface.queue_message(request)
    server.gui.reset()
    server.scene.reset()
    try:
        yield
    finally:  # clients that connect later have no use for it
        server._websock_server.get_message_buffer().remove_from_buffer(lambda message: message is request)


def stop_server(server: viser.ViserServer) -> None:
    """Stop a server; clients lose their connection."""
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a line
        server.stop()


def _require_free(host: str, port: int) -> None:
    """Refuse a port in use: viser would silently take the next one."""
    try:
        family = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except (OSError, OverflowError, UnicodeError) as error:
        raise InputError(f"port {port} on {host} cannot be used ({error}); choose another with --port") from None
