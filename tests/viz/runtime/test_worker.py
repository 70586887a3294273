"""The worker serves the newest request."""

import threading

import pytest

from odeform_viz.runtime.worker import Worker

DEADLINE = 180.0  # s, for a busy machine


def test_requests_during_a_round_are_merged_into_the_newest() -> None:
    request, served = [1], []
    begun, go_on, done = threading.Event(), threading.Event(), threading.Event()

    def serve() -> None:
        value = request[0]
        begun.set()
        assert go_on.wait(DEADLINE)
        served.append(value)
        if value == 40:
            done.set()

    worker = Worker(serve)
    worker.start()
    assert begun.wait(DEADLINE)
    for value in range(2, 41):
        request[0] = value
        worker.wake()
    assert not worker.up_to_date
    go_on.set()
    assert done.wait(DEADLINE)
    worker.stop()
    assert served == [1, 40]


def test_an_error_is_printed_and_does_not_end_the_worker(capsys: pytest.CaptureFixture[str]) -> None:
    rounds, failed, recovered = [], threading.Event(), threading.Event()

    def serve() -> None:
        rounds.append(1)
        if len(rounds) == 1:
            failed.set()
            raise RuntimeError("broken once")
        recovered.set()

    worker = Worker(serve)
    worker.start()
    assert failed.wait(DEADLINE)
    worker.wake()
    assert recovered.wait(DEADLINE)
    worker.stop()
    assert "broken once" in capsys.readouterr().err


def test_a_returned_pause_asks_for_another_round() -> None:
    rounds, done = [], threading.Event()

    def serve() -> float | None:
        rounds.append(1)
        if len(rounds) < 5:
            return 0.01
        done.set()
        return None

    worker = Worker(serve)
    worker.start()
    assert done.wait(DEADLINE)
    worker.stop()
    assert len(rounds) == 5


def test_an_error_of_a_call_that_outlasts_the_stop_is_not_printed(capsys: pytest.CaptureFixture[str]) -> None:
    begun, go_on = threading.Event(), threading.Event()

    def serve() -> None:
        begun.set()
        assert go_on.wait(DEADLINE)
        raise RuntimeError("the server is closed")

    worker = Worker(serve)
    worker.start()
    assert begun.wait(DEADLINE)
    stopping = threading.Thread(target=worker.stop)
    stopping.start()
    while worker.up_to_date:  # until it is told to stop
        threading.Event().wait(0.001)
    go_on.set()
    stopping.join(DEADLINE)
    assert not stopping.is_alive()
    assert capsys.readouterr().err == ""
