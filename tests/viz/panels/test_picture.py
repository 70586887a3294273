"""Pictures and films; `test_page_downloads` takes them in a browser."""

import itertools
import time
from typing import Any

import pytest
import viser

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.panels import picture
from odeform_viz.panels.picture import PicturePanel


@pytest.mark.parametrize("control", ["Screenshot (.png)", "Film (.webp)"])
def test_whoever_has_a_picture_can_ask_for_the_next_at_once(
    stubbed: tuple[App, LoopbackClient], monkeypatch: pytest.MonkeyPatch, control: str
) -> None:
    app, client = stubbed
    panel, answered = app.panel(PicturePanel), []
    send = viser.ClientHandle.send_file_download

    def sent(handle: viser.ClientHandle, *file: Any, **how: Any) -> None:
        panel._run(handle, lambda _: answered.append(file[0]))
        send(handle, *file, **how)

    monkeypatch.setattr(viser.ClientHandle, "send_file_download", sent)
    client.click(control)
    name = "screenshot.png" if control.startswith("Screenshot") else "motion.webp"
    assert client.until(lambda: client.downloaded(name) is not None)
    assert answered == [name]


def test_a_wall_clock_that_jumps_ends_no_picture(
    stubbed: tuple[App, LoopbackClient], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, client = stubbed
    hours = itertools.count()
    monkeypatch.setattr(time, "time", lambda: 3600.0 * next(hours))
    client.drawing_s = 0.5  # long enough for viser to look at the clock
    client.click("Screenshot (.png)")
    assert client.until(lambda: bool(client.downloaded("screenshot.png") or client.notifications))
    assert client.notifications == []


def test_a_browser_that_draws_nothing_is_not_waited_for(
    stubbed: tuple[App, LoopbackClient], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, client = stubbed
    monkeypatch.setattr(picture, "TIMEOUT", 0.01)
    client.drawing_s = 0.5
    client.click("Screenshot (.png)")
    assert client.until(lambda: client.notifications == ["the browser has drawn nothing within 0.01 s"])
