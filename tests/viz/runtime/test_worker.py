"""The newest request wins."""

import threading
import time

from odeform_viz.runtime.worker import Worker


def test_slow_work_serves_the_newest_wish_last_and_drops_the_older() -> None:
    request, served, done = [0], [], threading.Event()

    def serve() -> None:
        value = request[0]
        time.sleep(0.03)
        served.append(value)
        if value == 40:
            done.set()

    worker = Worker(serve)
    worker.start()
    for value in range(1, 41):
        request[0] = value
        worker.wake()
        time.sleep(0.002)
    assert done.wait(5.0)
    worker.stop()
    assert served == sorted(served)
    assert served[-1] == 40
    assert len(served) < 20


def test_an_error_does_not_end_the_worker(capsys) -> None:
    rounds = []

    def serve() -> None:
        rounds.append(1)
        if len(rounds) == 1:
            raise RuntimeError("broken once")

    worker = Worker(serve)
    worker.start()
    deadline = time.monotonic() + 5.0
    while len(rounds) < 2 and time.monotonic() < deadline:
        worker.wake()
        time.sleep(0.01)
    worker.stop()
    assert len(rounds) >= 2
    assert "broken once" in capsys.readouterr().err


def test_asks_to_be_called_again() -> None:
    rounds = []

    def serve() -> float | None:
        rounds.append(1)
        return 0.01 if len(rounds) < 5 else None

    worker = Worker(serve)
    worker.start()
    time.sleep(0.5)
    worker.stop()
    assert len(rounds) == 5
