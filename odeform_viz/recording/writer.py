"""Writes what is shown to a Rerun recording, from which every frame can be computed again."""

import json
import os
import shutil
import time
import uuid
from pathlib import Path
from typing import Any

import rerun as rr

from odeform.errors import InputError
from odeform.types import Geometry
from odeform_viz.columns import Column
from odeform_viz.recording.blueprint import make_blueprint
from odeform_viz.recording.entities import END, FORMAT, FRAME, HEADER, REQUEST, TIME, WORLD
from odeform_viz.recording.logged_column import LoggedColumn, log_still
from odeform_viz.recording.provenance import versions
from odeform_viz.view import Frame

__all__ = ["Recorder"]

FLUSH = 1.0  # s between flushes; a killed process loses at most this much
FLUSH_TIMEOUT = 10.0  # s


class Recorder:
    """Logs every published frame to a file. Use it from one thread: Rerun's current time is thread-local."""

    def __init__(self, path: str | Path) -> None:
        """Start a recording. `InputError` if the file cannot be written."""
        self.path = Path(path)
        self.frames = 0
        """Frames logged so far."""
        self._columns: dict[int, LoggedColumn] = {}
        self._visible: dict[str, LoggedColumn] = {}
        self._still: Geometry | None = None
        self._stream = self._open()
        self._flushed_size, self._flushed_at = 0, 0.0
        self._stream.log(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self._log_json(HEADER, {"odeform_recording": FORMAT, "versions": versions()}, static=True)
        self._flush()

    def _open(self) -> rr.RecordingStream:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("ab"):
                pass
        except OSError as error:
            raise InputError(f"recording {self.path}: cannot be written: {error.strerror}") from None
        # fewer, longer chunks than by default: each takes a kilobyte in the file and, until the end, in memory
        batches = rr.ChunkBatcherConfig(flush_tick=FLUSH)
        stream = rr.RecordingStream("odeform", recording_id=uuid.uuid4(), batcher_config=batches)
        try:
            stream.save(str(self.path))
        except RuntimeError as error:
            raise InputError(f"recording {self.path}: cannot be written: {error}") from None
        return stream

    def log(self, frame: Frame) -> None:
        """Log one frame. `InputError` if the disk is full; the file then ends with the last second flushed."""
        self._stream.set_time(FRAME, sequence=self.frames)
        self._stream.set_time(TIME, duration=frame.request.time)
        known = list(self._columns.values())
        visible = [(self._column(shown.column), shown) for shown in frame.columns]
        if list(self._columns.values()) != known:
            self._stream.send_blueprint(make_blueprint(self._columns.values()), make_default=True)
        self._clear_hidden({logged.name: logged for logged, _ in visible})
        if frame.still is not self._still:
            self._still = frame.still
            log_still(self._stream, frame.still)
        for name, value in frame.request.parameters.items():
            self._stream.log(["parameters", name], rr.Scalars(value))
        for logged, shown in visible:
            logged.log(shown, frame.request.time, self.frames)
        self._log_request(frame)
        self.frames += 1
        if time.monotonic() - self._flushed_at > FLUSH:
            self._flush()

    def close(self) -> None:
        """Complete the recording. `InputError` if its end cannot be written."""
        self._log_json(END, {"frames": self.frames}, static=True)
        self._flush()
        self._stream.disconnect()

    def _column(self, column: Column) -> LoggedColumn:
        """The column with its current shape; a new shape starts a new entity."""
        logged = self._columns.get(column.key)
        if logged is None or logged.column.geometry is not column.geometry:
            number = 0 if logged is None else logged.number + 1
            logged = self._columns[column.key] = LoggedColumn(self._stream, column, number)
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
            "parameters": {name: float(value) for name, value in frame.request.parameters.items()},
            "columns": {name: logged.frame for name, logged in self._visible.items()},
        }
        self._log_json(REQUEST, request)

    def _log_json(self, entity: str, value: Any, static: bool = False) -> None:
        """Log plain values as JSON; floats read back exactly."""
        self._stream.log(entity, rr.TextDocument(json.dumps(value, indent=1)), static=static)

    def _flush(self) -> None:
        try:
            self._stream.flush(timeout_sec=FLUSH_TIMEOUT)
            self._flushed_size, self._flushed_at = self.path.stat().st_size, time.monotonic()
        except (RuntimeError, ValueError, OSError):
            self._stream.disconnect()
            raise InputError(f"recording {self.path}: {self._truncate()}") from None

    def _truncate(self) -> str:
        """Remove a partly written end, so that the rest can be read; returns the reason for the user."""
        try:
            os.truncate(self.path, self._flushed_size)
            free = shutil.disk_usage(self.path.parent).free >> 20
        except OSError as error:
            return f"can no longer be written: {error.strerror}"
        return f"can no longer be written, with {free:,} MiB free on its disk; it ends before frame {self.frames}"
