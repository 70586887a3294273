"""Time: steps on frames, the peak, the start, speed, hot keys."""

import threading

import pytest

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App

Kicked = tuple[App, LoopbackClient]
FRAME = 1.0 / 120.0


def test_steps_lie_on_frames_by_button_and_by_key(kicked: Kicked) -> None:
    app, client = kicked  # at 0.03 s, between frames 3 and 4
    for way, frame in (("next", 5), ("next", 6), ("prev", 5)):
        client.set("go to", way)
        assert client.until(lambda frame=frame: app.clock.time() == pytest.approx(frame * FRAME))
    for key, frame in (("Next frame", 6), ("Previous frame", 5), ("Go to the start", 0), ("Previous frame", 0)):
        client.press(key)
        assert client.until(lambda frame=frame: app.clock.time() == pytest.approx(frame * FRAME))


def test_peak_is_at_the_kick_and_start_at_rest(kicked: Kicked) -> None:
    app, client = kicked
    client.set("go to", "peak")
    assert client.until(lambda: 0.005 < app.clock.time() < 0.029)
    client.set("go to", "start")
    assert client.until(lambda: app.clock.time() == 0.0)
    client.press("Go to the peak of the deformation")
    assert client.until(lambda: 0.005 < app.clock.time() < 0.029)


def test_a_peak_found_too_late_is_let_go(kicked: Kicked, monkeypatch: pytest.MonkeyPatch) -> None:
    app, client = kicked
    searching, found = threading.Event(), threading.Event()

    def search() -> float:
        searching.set()
        assert found.wait(60.0)
        return 0.02

    monkeypatch.setattr(app.session, "largest_deformation", lambda request: search())
    client.set("go to", "peak")
    assert searching.wait(60.0)
    client.set("time (s)", 0.5)
    assert client.until(lambda: app.clock.time() == 0.5)
    found.set()
    client.set("go to", "start")  # handled after the search has ended
    assert client.until(lambda: app.clock.time() == 0.0)


def test_play_is_a_button_and_a_key_and_says_what_it_would_do(kicked: Kicked) -> None:
    app, client = kicked
    client.click("Play")
    assert client.until(lambda: app.clock.playing and "Pause" in client.controls)
    for command in ("Play or pause", "Play or pause (K)", "Play or pause"):
        playing = app.clock.playing
        client.press(command)
        assert client.until(lambda playing=playing: app.clock.playing is not playing)
    assert client.until(lambda: not app.clock.playing and "Play" in client.controls)


def test_speed_is_that_of_the_list_or_refused(kicked: Kicked) -> None:
    app, client = kicked
    client.set("speed", "nonsense")
    assert client.until(lambda: any("speed" in said for said in client.notifications))
    client.set("speed", "1/50")
    client.set("loop", False)
    assert client.until(lambda: app.clock._speed == 0.02 and not app.clock.loop)


@pytest.mark.parametrize("moment", [float("nan"), float("inf"), -1.0, 1e9])
def test_moments_off_the_slider_are_refused(kicked: Kicked, moment: float) -> None:
    app, client = kicked
    client.set("time (s)", moment)
    assert client.until(lambda: any("time: expected" in said for said in client.notifications))
    assert app.clock.time() == 0.03
    assert client.until(lambda: client.controls["time (s)"].value == 0.03)
    client.set("go to", "nonsense")
    client.set("loop", False)  # the messages of a client are handled in order
    assert client.until(lambda: not app.clock.loop)
    assert app.clock.time() == 0.03


def test_a_time_set_while_it_plays_is_confirmed(kicked: Kicked) -> None:
    """A time that the clock has set may be on its way, and would stay in the browser."""
    app, client = kicked
    app.clock.play()
    app.page.wake()
    assert client.until(lambda: app.clock.time() > 0.05)
    client.set("time (s)", 0.25)
    client.controls["time (s)"].value = 0.24  # as the late one would
    assert client.until(lambda: client.controls["time (s)"].value == 0.25)
    assert client.until(lambda: not app.clock.playing and app.presenter.settled)
    assert app.clock.time() == 0.25
