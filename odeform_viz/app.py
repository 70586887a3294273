"""The viewer: a session, its panels and its scene, held together by one worker."""

import contextlib
import io
import socket
import sys
from collections.abc import Sequence

import viser

from odeform.errors import InputError
from odeform_viz.clock import Clock
from odeform_viz.panels.parameters import ParameterPanel
from odeform_viz.panels.playback import PlaybackPanel
from odeform_viz.panels.status import StatusPanel
from odeform_viz.recorder import Recorder
from odeform_viz.scene import SceneView
from odeform_viz.session import Column, Frame, Session, Wish, same_motions
from odeform_viz.worker import Worker

__all__ = ["App"]

TICK = 1.0 / 30.0  # s between frames while playing
SETTLE = 0.15  # s without a new wish after which the hand is taken to rest
SWITCH = 2e-4  # s after which a thread that waits for the interpreter gets it


class App:
    """Serves a page in which the user's wishes are met, the newest first and only."""

    def __init__(
        self, columns: Sequence[Column], host: str = "127.0.0.1", port: int = 8080, record: str | None = None
    ) -> None:
        self.session = Session(columns)
        _require_free(host, port)
        # the worker's many short numpy calls would keep the interpreter from the socket's thread for 5 ms at a time
        sys.setswitchinterval(SWITCH)
        self._recorder = Recorder(record, self.session.columns) if record else None
        with contextlib.redirect_stdout(io.StringIO()):  # viser prints a banner of its own
            self.server = viser.ViserServer(host=host, port=port, verbose=False)
        self.server.gui.configure_theme(
            titlebar_content=None,
            control_width="medium",
            show_logo=False,
            show_share_button=False,
            brand_color=(214, 96, 48),
        )
        self.server.gui.set_panel_label(f"ODeform · {self.session.schema.scene}")
        window = self.session.schema.window
        self.clock = Clock(window.start, window.stop)
        self._worker = Worker(self._serve)
        wake = self._worker.wake
        self._status = StatusPanel(self.server, self.session.columns)
        self._playback = PlaybackPanel(self.server, window, self.clock, wake, self._largest)
        self._parameters = ParameterPanel(self.server, self.session, wake)
        self._scene = SceneView(self.server, self.session.columns)
        with self.server.gui.add_folder("View"):
            follow = self.server.gui.add_checkbox("follow the body", initial_value=True)
        with self.server.gui.add_folder("About", expand_by_default=False):
            self.server.gui.add_markdown(_about(self.session))
        follow.on_update(lambda event: self._set_follow(bool(event.target.value)))
        self.server.gui.add_command("Play or pause", hotkey="K").on_trigger(lambda _: self._playback.toggle())
        self._shown: Frame | None = None
        self._settled = False
        self._dirty = False
        self.clock.play()
        self._worker.start()

    @property
    def url(self) -> str:
        host = self.server.get_host()
        return f"http://{'127.0.0.1' if host == '0.0.0.0' else host}:{self.server.get_port()}"

    def close(self) -> None:
        """Stop serving; a recording is completed."""
        self._worker.stop()
        if self._recorder:
            self._recorder.close()
        self.server.stop()

    def _wish(self) -> Wish:
        parameters = self.session.schema.complete(self._parameters.parameters())
        return Wish(parameters, self.clock.time(), self._parameters.quality(), self._parameters.visible())

    def _largest(self) -> float:
        wish = self._wish()
        return self.session.largest_deformation(wish) if any(wish.visible) else 0.0

    def _set_follow(self, follow: bool) -> None:
        self._scene.follow = follow
        self._dirty = True
        self._worker.wake()

    def _serve(self) -> float | None:
        """One round of the worker: read the newest wish, show it; once nothing has changed for a while, complete it."""
        try:
            wish = self._wish()
            if self._shown is None or wish != self._shown.wish or self._dirty:
                self._dirty = False
                frame = self.session.frame(wish)
                self._settled = self._shown is not None and same_motions(frame, self._shown)
                self._scene.publish(frame)
                self._playback.show(wish.time)
                self._status.show(frame, self._settled)
                self._shown = frame
                if self._recorder:
                    self._recorder.log(frame)
            elif not self._settled:
                self._settled = True
                self._status.show(self._shown, True)
        except InputError as error:
            self._status.show_error(str(error))
            self._dirty, self._settled = True, True  # what is shown next replaces the message, whatever it is
        if self.clock.playing:
            return TICK
        return None if self._settled else SETTLE


def _about(session: Session) -> str:
    """What the scene leaves fixed, what to keep in mind, and where the models come from."""
    checkpoint = session.columns[0].predictor.checkpoint
    fixed = ", ".join(f"{name} {value:.4g}" for name, value in checkpoint.provenance.get("fixed", {}).items())
    lines = [*session.schema.notes, f"Fixed: {fixed}."]
    lines += [f"Made by `{command}`." for command in checkpoint.provenance.get("command", [])]
    return "\n\n".join([*lines, "Press K to play or pause."])


def _require_free(host: str, port: int) -> None:
    """Viser would silently take the next port."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except (OSError, OverflowError) as error:
            raise InputError(f"port {port} on {host} cannot be used ({error}); choose another with --port") from None
