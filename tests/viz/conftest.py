"""A served viewer with a client, for tests of panels; and recordings made without either."""

import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import pytest
from stubs import StubPredictor

from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column, Columns
from odeform_viz.recording.writer import Recorder
from odeform_viz.session import Session
from odeform_viz.view import Frame, ViewRequest

Serve = Callable[..., tuple[App, LoopbackClient]]
Record = Callable[..., list[Frame]]


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
def serve(port: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> Iterator[Serve]:
    """Opens a viewer with these columns, paused at `moment`, and a client. The viewer must not print a traceback.

    Its workspace is `tmp_path`.
    """
    with ExitStack() as stack:

        def start(*columns: Column, moment: float = 0.03) -> tuple[App, LoopbackClient]:
            app = App(columns, port=port, workspace=tmp_path)
            stack.callback(app.close)
            client = stack.enter_context(LoopbackClient(port))
            client.set("time (s)", moment)
            assert client.until(lambda: app.clock.time() == moment and not app.clock.playing)
            assert client.until(lambda: _shows(app, moment))
            return app, client

        yield start
    assert "Traceback" not in capfd.readouterr().err


def _shows(app: App, moment: float) -> bool:
    """Whether the page shows this moment, and not the one before."""
    frame = app.presenter.frame
    return frame is not None and frame.request.time == moment and app.presenter.settled


@pytest.fixture
def stubbed(serve: Serve) -> tuple[App, LoopbackClient]:
    """A model that is a formula, paused at 0.2 s."""
    stub = StubPredictor()
    return serve(Column("stub", stub, stub.rest), moment=0.2)


@pytest.fixture
def kicked(serve: Serve, kick: Predictor) -> tuple[App, LoopbackClient]:
    """The bundled kick alone."""
    return serve(Column("odeform", kick, kick.rest, origin="kick"))


@pytest.fixture
def dropped(serve: Serve, drop: Predictor) -> tuple[App, LoopbackClient]:
    """The bundled drop alone, at its impact."""
    return serve(Column("odeform", drop, drop.rest, origin="mass-elastic"), moment=0.3)


@pytest.fixture
def record() -> Record:
    """Show columns at some times under the same sliders, and record it."""

    def make(
        path: Path,
        columns: Sequence[Column],
        times: Sequence[float] = (0.0, 0.02, 0.5),
        parameters: dict[str, float] | None = None,
        change: Callable[[Frame], Frame] = lambda frame: frame,
    ) -> list[Frame]:
        schema = columns[0].source.schema
        session, shown = Session(schema), Columns.of(columns).all
        path.unlink(missing_ok=True)
        recorder = Recorder(path)
        requests = [
            ViewRequest(schema.complete(parameters or {"mass": 0.6}), time, "balanced", shown) for time in times
        ]
        frames = [change(session.frame(request)) for request in requests]
        for frame in frames:
            recorder.log(frame)
        recorder.close()
        return frames

    return make
