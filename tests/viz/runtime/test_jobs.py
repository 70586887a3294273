"""Work in a process of its own."""

import os
import threading
import time
from collections.abc import Callable
from typing import Any

from odeform import InputError
from odeform_viz.runtime.jobs import Job, Report


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
    time.sleep(60.0)


class _Heard:
    """Collects what a job reports."""

    def __init__(self, work: Callable[..., Any], *args: Any) -> None:
        self.progress: list[float] = []
        self.said: list[Any] = []
        self.over = threading.Event()
        self.begun = threading.Event()
        self.job = Job(work, args, self._end, self._end, self._progress)
        self.job.start()

    def _progress(self, share: float) -> None:
        self.progress.append(share)
        self.begun.set()

    def _end(self, result: Any) -> None:
        self.said.append(result)
        self.over.set()


def test_progress_and_result_come_from_another_process() -> None:
    heard = _Heard(count, 3)
    assert heard.over.wait(30.0)
    assert heard.progress == [1 / 3, 2 / 3, 1.0]
    assert heard.said[0] != os.getpid()
    assert not heard.job.running


def test_a_failure_and_a_death_are_one_line() -> None:
    heard = [_Heard(fail, "no such ball"), _Heard(die)]
    assert all(h.over.wait(30.0) for h in heard)
    assert [h.said for h in heard] == [["no such ball"], ["the process ended with exit code 7"]]


def test_cancel_is_silent_and_prompt() -> None:
    heard = _Heard(sleep)
    assert heard.job.running
    assert heard.begun.wait(30.0)
    begin = time.monotonic()
    heard.job.cancel()
    assert time.monotonic() - begin < 5.0
    assert not heard.job.running
    assert heard.said == []
