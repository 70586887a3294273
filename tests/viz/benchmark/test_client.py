"""The client of benchmarks and tests."""

import logging
import threading
from collections.abc import Iterator

import numpy as np
import pytest
import viser

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.runtime.access import Access
from odeform_viz.runtime.server import open_server, stop_server

DEADLINE = 60.0  # s


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    server = open_server(Access(), 0, "client")
    server.gui.add_text("note", "")
    yield server
    stop_server(server)


def test_a_connection_is_cut_without_a_word_while_data_arrives(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    client = LoopbackClient(server.get_port())
    connection = client._socket
    arrived, read_on = threading.Event(), threading.Event()
    mutex, close_socket, recv = connection.protocol_mutex, connection.close_socket, connection.recv

    class Held:
        """The lock of the connection, which the thread that reads gets only once the other one goes on."""

        def __enter__(self) -> None:
            if threading.current_thread() is connection.recv_events_thread and not arrived.is_set():
                arrived.set()
                assert read_on.wait(DEADLINE)
            mutex.acquire()

        def __exit__(self, *_: object) -> None:
            mutex.release()

        def locked(self) -> bool:
            return mutex.locked()

    def closed() -> None:
        close_socket()
        read_on.set()

    def received(*arguments: float) -> object:
        read_on.set()
        return recv(*arguments)

    monkeypatch.setattr(connection, "protocol_mutex", Held())
    server.gui.set_panel_label("something to read")
    assert arrived.wait(DEADLINE)
    monkeypatch.setattr(connection, "close_socket", closed)
    monkeypatch.setattr(connection, "recv", received)
    with caplog.at_level(logging.ERROR):
        client.vanish()
    assert not connection.recv_events_thread.is_alive()
    assert caplog.text == ""


def test_controls_keep_no_messages(server: viser.ViserServer) -> None:
    plot = server.gui.add_uplot((np.arange(3.0), np.arange(3.0)), ({}, {"label": "plotted"}), title="plot")
    with LoopbackClient(server.get_port()) as client:
        control = client._controls[plot._impl.uuid]
        assert all(column.base is None for column in control.props["data"])
        plot.data = (np.arange(4.0), np.arange(4.0))
        assert client.until(lambda: len(control.props["data"][0]) == 4)
        assert all(column.base is None for column in control.props["data"])
