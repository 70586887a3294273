"""What is sent while a body moves: little, so that pages play over slow lines."""

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.panels.playback import PlaybackPanel
from odeform_viz.panels.status import StatusPanel


def test_play_and_pause_send_no_track(dropped: tuple[App, LoopbackClient]) -> None:
    app, client = dropped
    panel = app.panel(PlaybackPanel)
    assert client.until(lambda: "odeform-track" in panel._timeline.content)
    before, paused = panel._timeline.content, panel._state.content
    client.press("Play or pause")
    assert client.until(lambda: app.clock.playing and panel._state.content != paused)
    assert panel._timeline.content == before


def test_the_table_follows_rarely_while_it_plays_and_at_once_when_it_pauses(
    dropped: tuple[App, LoopbackClient],
) -> None:
    app, client = dropped
    panel = app.panel(StatusPanel)
    app.clock.play()
    panel._due = float("inf")
    first = app.presenter.frame
    app.page.wake()
    assert client.until(lambda: app.presenter.frame is not first and app.presenter.frame.request.time > 0.35)
    shown = panel._text.content
    assert client.until(lambda: app.presenter.frame.request.time > 0.5)
    assert panel._text.content == shown
    app.page.pause_at(0.6)
    assert client.until(lambda: panel._text.content != shown)
