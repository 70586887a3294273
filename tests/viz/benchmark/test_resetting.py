"""When the page is at rest."""

import threading

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_figures.viewer_benchmark.resetting import are_callbacks_done
from odeform_viz.app import App

DEADLINE = 60.0  # s


def test_a_page_whose_callback_runs_is_not_at_rest(
    stubbed: tuple[App, LoopbackClient],
) -> None:
    app, client = stubbed
    assert client.until(are_callbacks_done)
    began, end = threading.Event(), threading.Event()

    def wait(_: object) -> None:
        began.set()
        assert end.wait(DEADLINE)

    button = app.server.gui.add_button("wait")
    button.on_click(wait)
    client.click("wait")
    assert began.wait(DEADLINE)
    assert not are_callbacks_done()
    end.set()
    assert client.until(are_callbacks_done)
