"""Starts and stops a recording while frames are shown. A recording that fails ends; the viewer goes on."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from odeform.errors import InputError
from odeform_viz.recording.writer import Recorder
from odeform_viz.view import Frame

__all__ = ["RecordingControl", "RecordingStatus"]


@dataclass(frozen=True)
class RecordingStatus:
    """The recording in progress, or how the last one ended."""

    state: Literal["idle", "active", "finished", "failed"] = "idle"
    path: str = ""
    frames: int = 0
    error: str = ""


class RecordingControl:
    """Callbacks ask for a start or a stop; the worker carries it out, since Rerun's clock belongs to one thread."""

    def __init__(self, path: str | Path | None = None, watched: Callable[[], bool] = lambda: True) -> None:
        """Records to `path` from the first frame on, but only while the page is `watched` by anybody.

        `InputError` where nothing can be written.
        """
        self._requested = path
        self._recorder = Recorder(path) if path else None
        self._watched, self._was_watched = watched, False
        self.report: Callable[[RecordingStatus], None] = lambda _: None
        """Called on the worker's thread whenever the status changes, frames included."""

    def start(self, path: str | Path) -> None:
        """Ask for a recording; `report` says whether it could be started. No file is overwritten."""
        self._requested = path

    def stop(self) -> None:
        """Ask for the end of the recording."""
        self._requested = None

    @property
    def active(self) -> bool:
        """Whether a recording is in progress."""
        return self._recorder is not None

    def sync(self) -> bool:
        """Start or stop as requested; whether the frame on screen has to be recorded, although it is not new."""
        requested, recorder = self._requested, self._recorder
        watched = self._watched()
        started, self._was_watched = watched and not self._was_watched and recorder is not None, watched
        try:
            if recorder is not None and requested is None:
                self._recorder = None
                recorder.close()
                self.report(RecordingStatus("finished", str(recorder.path), recorder.frames))
            elif recorder is None and requested is not None:
                self._recorder, started = Recorder(requested), True
        except InputError as error:
            self._fail(error)
        if self._recorder is not None:
            self.report(RecordingStatus("active", str(self._recorder.path), self._recorder.frames))
        return started

    def log(self, frame: Frame) -> None:
        """Add a frame, if a recording is in progress and anybody watches."""
        if self._recorder is not None and self._watched():
            try:
                self._recorder.log(frame)
            except InputError as error:
                self._fail(error)

    def close(self) -> None:
        """Complete the recording; call it when no more frames come."""
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            try:
                recorder.close()
            except InputError as error:  # the page is closed already
                print(f"error: {error}", file=sys.stderr)

    def _fail(self, error: InputError) -> None:
        if self._recorder is not None:  # a frame that cannot be logged has not ended it
            self._recorder.abandon()
        self._recorder = self._requested = None
        self.report(RecordingStatus("failed", error=str(error)))
        # a user who started it from the command line may not have its tab open
        print(f"error: {error}", file=sys.stderr)
