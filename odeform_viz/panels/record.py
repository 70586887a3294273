"""Recording all frames to a file."""

import itertools
from pathlib import Path

import viser

from odeform.errors import InputError
from odeform_viz.page import Page, Panel
from odeform_viz.recording.control import RecordingStatus

__all__ = ["RecordPanel"]

EXPLAINED = "Records every frame, and what is needed to check it with `odeform-viz --replay FILE`."


class RecordPanel(Panel):
    """Starts and stops a recording, and shows its progress."""

    def __init__(self, page: Page) -> None:
        self._page, gui = page, page.server.gui
        with gui.add_folder("Recording"):
            self._stem = f"odeform-{page.schema.scene}"
            self._path = gui.add_text("file", f"{self._stem}.rrd", hint="in the viewer's --workspace folder")
            self._start = gui.add_button("Start recording", icon=viser.Icon.PLAYER_RECORD)
            self._stop = gui.add_button("Stop recording", icon=viser.Icon.PLAYER_STOP, visible=False)
            self._start.on_click(lambda _: self._begin())
            self._stop.on_click(lambda _: self._end())
            self._text = gui.add_markdown(EXPLAINED)
        page.recording.report = self.show

    def _begin(self) -> None:
        try:
            self._page.recording.start(self._page.workspace.inside(self._path.value))
        except InputError as error:
            self.show(RecordingStatus("failed", error=str(error)))
        self._page.wake()

    def _end(self) -> None:
        self._page.recording.stop()
        self._page.wake()

    def show(self, status: RecordingStatus) -> None:
        """Show the progress of a recording, or how it ended."""
        active = status.state == "active"
        if active:
            self._text.content = f"**recording** to `{status.path}`, {status.frames} frames"
        elif status.state == "failed":
            self._text.content = f"⚠ **{status.error}**"
        elif status.state == "finished":
            check = f"check it with `odeform-viz --replay {status.path}`"
            self._text.content = f"`{status.path}`, {status.frames} frames: {check}"
            free = (Path(status.path).with_stem(f"{self._stem}-{n}") for n in itertools.count(2))
            self._path.value = str(next(path for path in free if not path.exists()))
        # last: who sees the button may type the next name at once
        self._start.visible, self._stop.visible, self._path.disabled = not active, active, active
