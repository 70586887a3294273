"""viser's server, made safe to use from any thread."""

import asyncio
import threading
from collections.abc import Iterator

import pytest
import viser

from odeform.errors import InputError
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.runtime.access import Access
from odeform_viz.runtime.server import _LoopEvent, open_server


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    server = open_server(Access(), 0, "test")
    yield server
    server.stop()


def test_the_event_is_set_only_on_the_loop() -> None:
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
        await asyncio.wait_for(waiting, 60.0)
        thread.join()
        return event.is_set()

    assert asyncio.run(wait())


def test_many_threads_may_send(server: viser.ViserServer) -> None:
    failed = []
    text = server.gui.add_markdown("")

    def send(number: int) -> None:
        try:
            for index in range(200):
                text.content = f"{number} {index}"
        except RuntimeError as error:
            failed.append(error)

    threads = [threading.Thread(target=send, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed


def test_a_port_in_use_is_refused(server: viser.ViserServer) -> None:
    with pytest.raises(InputError, match="choose another with --port"):
        open_server(Access(), server.get_port(), "test")


def test_many_threads_may_notify_a_client(server: viser.ViserServer) -> None:
    server.gui.add_markdown("a page")
    with LoopbackClient(server.get_port()) as client:
        assert client.until(lambda: bool(server.get_clients()))
        (handle,) = server.get_clients().values()
        assert isinstance(handle._websock_connection.get_message_buffer().message_event, _LoopEvent)
        threads = [threading.Thread(target=handle.add_notification, args=("", str(number))) for number in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert client.until(lambda: sorted(client.notifications) == [str(number) for number in range(8)])
