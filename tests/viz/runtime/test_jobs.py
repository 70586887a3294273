"""Jobs run in a process of their own."""

import os
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from odeform import InputError
from odeform_viz.runtime.jobs import Job, Report

pytestmark = pytest.mark.slow

DEADLINE = 60.0  # s, for a busy machine


def count(report: Report, until: int) -> int:
    for step in range(until):
        report((step + 1) / until)
    return os.getpid()


def fail(report: Report, message: str) -> None:
    raise InputError(message)


def die(report: Report) -> None:
    os._exit(7)


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


def test_a_cancelled_job_ends_without_a_callback() -> None:
    listener = _Listener(sleep)
    assert listener.job.running
    assert listener.begun.wait(DEADLINE)
    listener.job.cancel()
    listener.job._process.join(DEADLINE)
    assert listener.job._process.exitcode is not None
    assert not listener.job.running
    assert listener.results == []
