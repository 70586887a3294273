"""What is made safe about viser's server."""

import asyncio
import threading

import pytest

from odeform.errors import InputError
from odeform_viz.runtime.server import _LoopEvent, open_server


def test_event_is_set_on_the_loop_alone() -> None:
    async def wait() -> bool:
        event, loop = _LoopEvent(), asyncio.get_running_loop()
        waiting = asyncio.create_task(event.wait())
        await asyncio.sleep(0)

        def from_a_thread() -> None:
            event.set()
            assert not event.is_set()
            loop.call_soon_threadsafe(event.set)

        thread = threading.Thread(target=from_a_thread)
        thread.start()
        await asyncio.wait_for(waiting, 5.0)
        thread.join()
        return event.is_set()

    assert asyncio.run(wait())


def test_many_threads_may_talk(port: int) -> None:
    server, failed = open_server("127.0.0.1", port, "test"), []
    text = server.gui.add_markdown("")

    def talk(number: int) -> None:
        try:
            for index in range(200):
                text.content = f"{number} {index}"
        except RuntimeError as error:
            failed.append(error)

    threads = [threading.Thread(target=talk, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    server.stop()
    assert not failed


def test_a_port_that_is_taken_is_refused(port: int) -> None:
    server = open_server("127.0.0.1", port, "test")
    with pytest.raises(InputError, match="choose another with --port"):
        open_server("127.0.0.1", port, "test")
    server.stop()
