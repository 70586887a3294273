"""What one takes away: a recording, the state of the page, the motion as a file."""

import itertools
import tempfile
from collections.abc import Callable
from pathlib import Path

import viser

from odeform.errors import InputError
from odeform.formats.registry import motion_formats, shape_formats

__all__ = ["EXPORTS", "RecordPanel"]

EXPORTS = {f"this moment ({suffix})": suffix for suffix in shape_formats()}
EXPORTS |= {f"the whole motion ({suffix})": suffix for suffix in motion_formats() if suffix not in EXPORTS.values()}


class RecordPanel:
    """Buttons; the work is done by what it is given."""

    def __init__(
        self,
        server: viser.ViserServer,
        scene: str,
        record: Callable[[str | None], None],
        save: Callable[[], bytes],
        restore: Callable[[bytes], None],
        export: Callable[[Path], Path],
        say: Callable[[str], None],
    ) -> None:
        """`record` starts a recording at a path, or ends it given None; `save` and `restore` the page's state as JSON;
        `export` writes the first model's motion to the folder given, by the ending of the path, and returns the file.
        """
        self._record, self._say = record, say
        gui = server.gui
        with gui.add_folder("Recording"):
            self._stem = f"odeform-{scene}"
            self._path = gui.add_text("file", f"{self._stem}.rrd", hint="where the viewer runs")
            self._start = gui.add_button("Start recording", icon=viser.Icon.PLAYER_RECORD)
            self._stop = gui.add_button("Stop recording", icon=viser.Icon.PLAYER_STOP, visible=False)
            self._start.on_click(lambda _: record(self._path.value))
            self._stop.on_click(lambda _: record(None))
            self._said = gui.add_markdown("Everything that is shown, with what it takes to check it: "
                                          "`odeform-viz --replay FILE`.")  # fmt: skip
        with gui.add_folder("State of the page"):
            keep = gui.add_button("Save state", color="gray", hint="columns, parameters, moment, as a small file")
            keep.on_click(lambda event: self._send(event, f"odeform-{scene}.json", save))
            load = gui.add_upload_button("Restore state", color="gray", mime_type="application/json")
            load.on_upload(lambda event: self._guarded(lambda: restore(event.target.value.content)))
        with gui.add_folder("Export"):
            self._format = gui.add_dropdown("what", tuple(EXPORTS))
            out = gui.add_button("Download", color="gray", hint="of the first model, in the shape's own units")
            out.on_click(lambda event: self._exported(event, export))

    def show(self, recording: str | None, frames: int, problem: str = "") -> None:
        """The recording under way, if any; called by the worker."""
        self._start.visible, self._stop.visible = recording is None, recording is not None
        self._path.disabled = recording is not None
        if recording is not None:
            self._said.content = f"**recording** to `{recording}`, {frames} frames"
        elif problem:
            self._said.content = f"⚠ **{problem}**"

    def finished(self, recording: str, frames: int) -> None:
        self.show(None, 0)
        self._said.content = f"`{recording}`, {frames} frames: `odeform-viz --replay {recording}` checks it"
        done = Path(recording)
        free = (done.with_stem(f"{self._stem}-{n}") for n in itertools.count(2))
        self._path.value = str(next(path for path in free if not path.exists()))

    def _guarded(self, action: Callable[[], None]) -> None:
        try:
            action()
        except (InputError, OSError) as error:
            self._say(str(error))

    def _send(self, event: viser.GuiEvent, name: str, content: Callable[[], bytes]) -> None:
        if event.client is not None:
            client = event.client
            self._guarded(lambda: client.send_file_download(name, content(), save_immediately=True))

    def _exported(self, event: viser.GuiEvent, export: Callable[[Path], Path]) -> None:
        if event.client is None:
            return
        client = event.client

        def work() -> None:
            if self._format.value not in EXPORTS:
                raise InputError(f"export: expected one of {', '.join(EXPORTS)}, got {self._format.value!r}")
            with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
                file = export(Path(folder) / f"motion{EXPORTS[self._format.value]}")
                client.send_file_download(file.name, file.read_bytes(), save_immediately=True)

        self._guarded(work)
