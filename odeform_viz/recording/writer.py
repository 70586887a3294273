"""Writes what is shown to a Rerun recording, from which every frame can be computed again."""

import contextlib
import io
import json
import shutil
import time
import uuid
from pathlib import Path
from typing import Any

import rerun as rr

from odeform.errors import InputError
from odeform.schema import OBJECT
from odeform.types import Geometry
from odeform_viz.columns import Column
from odeform_viz.recording.blueprint import make_blueprint
from odeform_viz.recording.drain import Drain
from odeform_viz.recording.entities import END, FORMAT, FRAME, HEADER, REQUEST, TIME, WORLD
from odeform_viz.recording.logged_column import LoggedColumn
from odeform_viz.recording.provenance import versions
from odeform_viz.recording.shown_points import ShownBudget
from odeform_viz.recording.streams import end_unused_streams, send_blueprint
from odeform_viz.recording.surroundings import log_surroundings
from odeform_viz.view import Frame

__all__ = ["Recorder"]

FLUSH = 1.0  # s between writes to the file; a killed process loses at most this much


class Recorder:
    """Logs every published frame to a file. Use it from one thread: Rerun's current time is thread-local."""

    def __init__(self, path: str | Path) -> None:
        """Start a recording. `InputError` if the file cannot be written, exists, or has another suffix than .rrd."""
        self.path = Path(path)
        self.frames = 0
        """Frames logged so far."""
        self._columns: dict[int, LoggedColumn] = {}
        self._visible: dict[str, LoggedColumn] = {}
        self._still: Geometry | None = None
        self._budget = ShownBudget()
        self._file = self._open()
        end_unused_streams()  # those of earlier recordings
        # fewer, longer chunks than by default: each takes a kilobyte in the file and, until the end, in memory
        batches = rr.ChunkBatcherConfig(flush_tick=FLUSH)
        self._stream = rr.RecordingStream("odeform", recording_id=uuid.uuid4(), batcher_config=batches)
        self._drain = Drain(self._stream)
        self._written, self._written_frames, self._written_at = 0, 0, 0.0
        self._stream.log(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self._log_json(HEADER, {"odeform_recording": FORMAT, "versions": versions()}, static=True)
        self._write_taken()

    def _open(self) -> io.FileIO:
        """A new file: none is ever overwritten."""
        if self.path.suffix != ".rrd":
            raise InputError(f"recording {self.path}: expected a name ending in .rrd")
        if self.path.is_file():
            raise InputError(f"recording {self.path}: the file exists; choose a new name")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            return io.FileIO(self.path, "x")
        except OSError as error:
            raise InputError(f"recording {self.path}: cannot be written: {error.strerror}") from None

    def log(self, frame: Frame) -> None:
        """Log one frame. `InputError` if the disk is full; the file then ends with the last second written."""
        self._stream.set_time(FRAME, sequence=self.frames)
        self._stream.set_time(TIME, duration=frame.request.time)
        known = list(self._columns.values())
        visible = [(self._column(shown.column), shown) for shown in frame.columns]
        if list(self._columns.values()) != known:
            send_blueprint(self._stream, make_blueprint(self._columns.values()))
        self._clear_hidden({logged.name: logged for logged, _ in visible})
        if self.frames == 0 or frame.still is not self._still:
            self._still = frame.still
            log_surroundings(self._stream, frame.still)
        self._budget.next_frame()
        for name, value in frame.request.parameters.items():
            if name != OBJECT:
                self._stream.log(["parameters", name], rr.Scalars(value))
        for logged, shown in visible:
            logged.log(shown, frame.request.time, self.frames)
        self._log_request(frame)
        self.frames += 1
        if time.monotonic() - self._written_at > FLUSH:
            self._write_taken()

    def note(self, text: str) -> None:
        """Log a warning about all frames."""
        self._stream.log("status/notes", rr.TextLog(text, level=rr.TextLogLevel.WARN), static=True)

    def close(self) -> None:
        """Complete the recording. `InputError` if its end cannot be written."""
        self._log_json(END, {"frames": self.frames}, static=True)
        self._write_taken()
        self._write(self._drain.close())
        self._file.close()

    def abandon(self) -> None:
        """End the recording with the last message that was written as a whole, unless it has ended."""
        self._drain.close()
        if not self._file.closed:
            with self._file, contextlib.suppress(OSError):
                self._file.truncate(self._written)

    def _column(self, column: Column) -> LoggedColumn:
        """The column with its current shape; a new shape starts a new entity."""
        logged = self._columns.get(column.key)
        if logged is None or logged.column.geometry is not column.geometry:
            number = 0 if logged is None else logged.number + 1
            logged = self._columns[column.key] = LoggedColumn(self._stream, column, number, self._budget)
        return logged

    def _clear_hidden(self, visible: dict[str, LoggedColumn]) -> None:
        for name in self._visible.keys() - visible.keys():
            self._stream.log(f"{WORLD}/{name}", rr.Clear(recursive=True))
            self._visible[name].forget()
        self._visible = visible

    def _log_request(self, frame: Frame) -> None:
        request = {
            "time": float(frame.request.time),
            "quality": frame.request.quality,
            "parameters": {n: v if n == OBJECT else float(v) for n, v in frame.request.parameters.items()},
            "columns": {name: logged.frame for name, logged in self._visible.items()},
        }
        self._log_json(REQUEST, request)

    def _log_json(self, entity: str, value: Any, static: bool = False) -> None:
        """Log plain values as JSON; floats read back exactly."""
        self._stream.log(entity, rr.TextDocument(json.dumps(value)), static=static)

    def _write_taken(self) -> None:
        """Write what was logged since the last call."""
        try:
            data = self._drain.take()
        except (RuntimeError, ValueError) as error:
            raise self._ended(str(error)) from None
        self._write(data)

    def _write(self, data: bytes) -> None:
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            raise self._ended(error.strerror or str(error)) from None
        self._written += len(data)
        self._written_frames, self._written_at = self.frames, time.monotonic()

    def _ended(self, reason: str) -> InputError:
        """End the recording with the last message that was written as a whole; the error to raise."""
        self.abandon()
        with contextlib.suppress(OSError):
            free = shutil.disk_usage(self.path.parent).free >> 20
            reason += f", {free:,} MiB free"
        kept = f"it holds the first {self._written_frames} frames" if self._written_frames else "it holds no frame"
        return InputError(f"recording {self.path}: can no longer be written ({reason}); {kept}")
