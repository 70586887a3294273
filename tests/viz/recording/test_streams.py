"""What a recording leaves behind."""

import threading
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from stubs import StubPredictor

from odeform import InputError
from odeform_viz.columns import Column
from odeform_viz.motion_files import write_rrd
from odeform_viz.recording.control import RecordingControl, RecordingStatus
from odeform_viz.recording.logged_column import LoggedColumn
from odeform_viz.recording.streams import end_unused_streams
from odeform_viz.recording.writer import Recorder
from odeform_viz.view import Frame

Record = Callable[..., list[Frame]]
TASKS = Path("/proc/self/task")
needs_proc = pytest.mark.skipif(not TASKS.is_dir(), reason="threads of Rerun are listed on Linux only")


def _threads() -> int:
    """Threads of Rerun's streams, in this process."""
    return Counter((task / "comm").read_text().strip() for task in TASKS.iterdir())["RecordingStream"]


def _collecting() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "odeform-recording"]


@needs_proc
def test_no_thread_is_left_of_a_recording(tmp_path: Path, record: Record) -> None:
    stub = StubPredictor()
    end_unused_streams()
    before = _threads()
    for _ in range(3):
        record(tmp_path / "a.rrd", [Column("stub", stub, stub.rest)])
    end_unused_streams()
    assert _threads() == before
    assert _collecting() == []


def test_a_recording_can_start_while_another_has_much_to_write(tmp_path: Path, record: Record) -> None:
    stub = StubPredictor()
    (frame,) = record(tmp_path / "a.rrd", [Column("stub", stub, stub.rest)], [0.1])
    first = Recorder(tmp_path / "first.rrd")
    for _ in range(100):
        first.log(frame)
    second = Recorder(tmp_path / "second.rrd")
    first.close()
    second.close()


def test_a_frame_that_cannot_be_logged_ends_the_recording(
    tmp_path: Path, record: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    stub = StubPredictor()
    (frame,) = record(tmp_path / "a.rrd", [Column("stub", stub, stub.rest)], [0.1])
    path, reports = tmp_path / "b.rrd", list[RecordingStatus]()
    monkeypatch.setattr(LoggedColumn, "log", _refuse)
    control = RecordingControl(path)
    control.report = reports.append
    control.sync()
    control.log(frame)
    assert reports[-1] == RecordingStatus("failed", error="refused")
    with pytest.raises(InputError, match="refused"), (tmp_path / "c.rrd").open("wb") as file:
        write_rrd(file, stub.solve(None, frame.request.parameters), np.array([0.1]), None)
    assert _collecting() == []


def _refuse(*_: object) -> None:
    raise InputError("refused")
