"""Jobs run in a process of their own."""

import os
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from odeform import InputError
from odeform_viz.runtime.jobs import Job, Report

pytestmark = pytest.mark.slow

DEADLINE = 180.0  # s, for a busy machine


def count(report: Report, until: int) -> int:
    for step in range(until):
        report((step + 1) / until)
    return os.getpid()


def fail(report: Report, message: str) -> None:
    raise InputError(message)


def die(report: Report) -> None:
    os._exit(7)


def die_in_a_message(report: Report) -> None:
    outbox = report.__closure__[0].cell_contents  # pyright: ignore
    os.write(outbox.fileno(), struct.pack("!i", 1000) + b"half")
    os.kill(os.getpid(), signal.SIGKILL)


def sleep(report: Report) -> None:
    report(0.0)
    time.sleep(10.0 * DEADLINE)


class _Listener:
    """Starts a job and collects what it reports."""

    def __init__(self, work: Callable[..., Any], *args: Any) -> None:
        self.progress: list[float] = []
        self.results: list[Any] = []
        self.ended, self.begun = threading.Event(), threading.Event()
        self.job = Job(work, args, self._end, self._end, self._progress)
        self.job.start()

    def _progress(self, fraction: float) -> None:
        self.progress.append(fraction)
        self.begun.set()

    def _end(self, result: Any) -> None:
        self.results.append(result)
        self.ended.set()


def test_progress_and_result_come_from_another_process() -> None:
    listener = _Listener(count, 3)
    assert listener.ended.wait(DEADLINE)
    assert listener.progress == [1 / 3, 2 / 3, 1.0]
    assert listener.results[0] != os.getpid()
    assert not listener.job.running


def test_a_failure_and_a_crash_are_one_line() -> None:
    listeners = [_Listener(fail, "no such ball"), _Listener(die)]
    assert all(listener.ended.wait(DEADLINE) for listener in listeners)
    assert [listener.results for listener in listeners] == [["no such ball"], ["the process ended with exit code 7"]]


def test_a_killed_process_says_so_at_any_moment() -> None:
    listeners = [_Listener(sleep), _Listener(die_in_a_message)]
    assert listeners[0].begun.wait(DEADLINE)
    pid = listeners[0].job._process.pid
    assert pid is not None
    os.kill(pid, signal.SIGKILL)
    for listener in listeners:
        assert listener.ended.wait(DEADLINE)
        assert listener.results == ["the process was ended by SIGKILL, perhaps for lack of memory"]
        assert not listener.job.running


def test_a_process_that_cannot_be_started_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_: object) -> None:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr("multiprocessing.context.SpawnProcess.start", refuse)
    listener = _Listener(count, 3)
    assert listener.results == ["no process could be started: Resource temporarily unavailable"]
    assert not listener.job.running
    listener.job.cancel()


class _Slow:
    """Takes its time to be sent to the process."""

    def __init__(self) -> None:
        self.sending, self.go_on = threading.Event(), threading.Event()

    def __reduce__(self) -> tuple[type, tuple[()]]:
        self.sending.set()
        assert self.go_on.wait(DEADLINE)
        return _Slow, ()


def test_a_job_can_be_cancelled_while_its_process_starts() -> None:
    slow = _Slow()
    job = Job(fail, (slow,), pytest.fail, pytest.fail)
    starting, faults = threading.Thread(target=job.start), []

    def cancel() -> None:
        try:
            job.cancel()
        except AttributeError as error:
            faults.append(error)

    starting.start()
    assert slow.sending.wait(DEADLINE)
    cancelling = threading.Thread(target=cancel)
    cancelling.start()
    slow.go_on.set()
    for thread in (starting, cancelling):
        thread.join(DEADLINE)
    assert not faults
    assert not job.running
    job._process.join(DEADLINE)
    assert job._process.exitcode == -signal.SIGTERM


VIEWER = """
import os, signal, sys
sys.path.insert(0, {folder!r})
from test_jobs import sleep
from odeform_viz.runtime.jobs import Job
def begun(_):
    print(job._process.pid, flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
if __name__ == "__main__":
    job = Job(sleep, (), print, print, begun)
    job.start()
    job._thread.join()
"""


def test_a_job_ends_with_a_viewer_that_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "viewer.py"
    script.write_text(VIEWER.format(folder=str(Path(__file__).parent)))
    viewer = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert viewer.stdout is not None
    pid, end = int(viewer.stdout.readline()), time.monotonic() + DEADLINE
    assert viewer.wait(DEADLINE) == -signal.SIGKILL
    viewer.stdout.close()
    while _runs(pid):
        assert time.monotonic() < end
        time.sleep(0.05)


def _runs(pid: int) -> bool:
    """A process without a parent may stay as a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_cancelled_job_ends_without_a_callback() -> None:
    listener = _Listener(sleep)
    assert listener.job.running
    assert listener.begun.wait(DEADLINE)
    listener.job.cancel()
    listener.job._process.join(DEADLINE)
    assert listener.job._process.exitcode is not None
    assert not listener.job.running
    assert listener.results == []
