"""A viewer that is served, and a client of it: what tests of panels need."""

import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from odeform.predictor import Predictor, load
from odeform_viz.app import App
from odeform_viz.columns import Column
from odeform_viz.loopback import LoopbackClient

Serve = Callable[..., tuple[App, LoopbackClient]]


@pytest.fixture
def port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(scope="session")
def drop() -> Predictor:
    """The bundled model of the scene that has a bundled data set."""
    return load("mass-elastic")


@pytest.fixture
def serve(port: int, capfd: pytest.CaptureFixture[str]) -> Iterator[Serve]:
    """Opens a viewer with these columns, paused at `moment`, and a client; afterwards nothing may have gone wrong."""
    with ExitStack() as stack:

        def start(*columns: Column, moment: float = 0.03) -> tuple[App, LoopbackClient]:
            app = App(columns, port=port)
            stack.callback(app.close)
            client = stack.enter_context(LoopbackClient(port))
            client.set("time (s)", moment)
            assert client.until(lambda: app.clock.time() == moment and not app.clock.playing)
            client.collect(0.3)
            return app, client

        yield start
    assert "Traceback" not in capfd.readouterr().err


@pytest.fixture
def kicked(serve: Serve, kick: Predictor) -> tuple[App, LoopbackClient]:
    """The bundled kick alone."""
    return serve(Column("odeform", kick, kick.rest, origin="kick"))


@pytest.fixture
def dropped(serve: Serve, drop: Predictor) -> tuple[App, LoopbackClient]:
    """The bundled drop alone, at its impact."""
    return serve(Column("odeform", drop, drop.rest, origin="mass-elastic"), moment=0.3)
