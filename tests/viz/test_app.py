"""The running viewer, seen through its protocol."""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from odeform import InputError
from odeform.cancellation import check_cancelled
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform_viz.app import App
from odeform_viz.benchmark.client import LoopbackClient
from odeform_viz.columns import Column
from odeform_viz.rendering.checkerboard import checkerboard_parts

BODY = "/world/column_0/body/part_0"


@pytest.fixture
def app(kick: Predictor, port: int, capfd: pytest.CaptureFixture[str]) -> Iterator[App]:
    app = App([Column("odeform", kick, kick.rest)], port=port)
    yield app
    app.close()
    assert "Traceback" not in capfd.readouterr().err


def test_has_the_sliders_of_the_scene(app: App, port: int) -> None:
    with LoopbackClient(port) as client:
        for parameter in app.session.schema.parameters:
            assert f"{parameter.name} ({parameter.unit})" in client.controls
        assert "time (s)" in client.controls


def test_opens_playing_and_a_hand_on_time_stops_it(app: App, port: int) -> None:
    with LoopbackClient(port) as client:
        assert client.wait_vertices(BODY) is not None
        client.set("time (s)", 0.5)
        time.sleep(0.3)
        assert not app.clock.playing
        assert app.clock.time() == pytest.approx(0.5)


@pytest.mark.parametrize(("label", "value"), [("mass (kg)", 0.9), ("bending (N m)", 1.5), ("force (N)", 110.0)])
def test_a_slider_moves_the_mesh(app: App, kick: Predictor, port: int, label: str, value: float) -> None:
    with LoopbackClient(port) as client:
        client.set("time (s)", 0.02)
        client.collect(0.5)
        client.set(label, value)
        shown = client.wait_vertices(BODY)
    expected = kick.solve(kick.rest, {label.split()[0]: value}).deformed(0.02)
    np.testing.assert_array_equal(shown, checkerboard_parts(kick.rest)[0].vertices(expected))


def test_after_a_storm_of_messages_the_last_wish_is_shown(app: App, kick: Predictor, port: int) -> None:
    with LoopbackClient(port) as client:
        client.set("time (s)", 0.03)
        client.collect(0.5)
        values = np.linspace(0.31, 0.95, 150)
        for value in values:
            client.set("mass (kg)", float(value))
        last = None
        while (vertices := client.wait_vertices(BODY, 1.0)) is not None:
            last = vertices
    expected = kick.solve(kick.rest, {"mass": float(values[-1])}).deformed(0.03)
    np.testing.assert_array_equal(last, checkerboard_parts(kick.rest)[0].vertices(expected))


def test_values_that_no_slider_sends_leave_the_last_frame_and_a_message(app: App, port: int) -> None:
    with LoopbackClient(port) as client:
        client.set("time (s)", 0.03)
        client.collect(0.5)
        client.set("mass (kg)", float("nan"))
        assert client.wait_vertices(BODY, 0.7) is None
        assert "expected a finite number" in client.text()
        client.set("mass (kg)", 0.5)  # back to what is on screen: the message goes
        client.collect(0.7)
        assert "expected a finite number" not in client.text()
        client.set("quality", "nonsense")
        client.set("mass (kg)", 0.6)
        client.collect(0.7)
        assert "quality" in client.text()
        client.set("quality", "draft")
        assert client.wait_vertices(BODY) is not None


def test_beyond_the_trained_range_the_page_says_so(app: App, port: int) -> None:
    with LoopbackClient(port) as client:
        client.set("time (s)", 1.2)
        client.collect(0.3)
        client.set("mass (kg)", 1.1)
        client.collect(0.7)
        assert "extrapolated" in client.text()
        assert "time, mass" in client.text()


def test_a_port_in_use_is_refused(app: App, kick: Predictor, port: int) -> None:
    with pytest.raises(InputError, match=str(port)):
        App([Column("odeform", kick, kick.rest)], port=port)


def test_two_people_at_one_slider_see_the_newest(app: App, kick: Predictor, port: int) -> None:
    with LoopbackClient(port) as one, LoopbackClient(port) as two:
        one.set("time (s)", 0.03)
        one.collect(0.3)
        for value in np.linspace(0.4, 0.8, 20):
            one.set("mass (kg)", float(value))
            two.set("mass (kg)", float(value) + 0.1)
        two.until(lambda: False, 1.0)
        two.set("mass (kg)", 0.55)
        last = [None, None]
        for index, client in enumerate((one, two)):
            while (vertices := client.wait_vertices(BODY, 0.7)) is not None:
                last[index] = vertices
        assert one.controls["mass (kg)"].value == two.controls["mass (kg)"].value == 0.55
    expected = checkerboard_parts(kick.rest)[0].vertices(kick.solve(kick.rest, {"mass": 0.55}).deformed(0.03))
    for vertices in last:
        np.testing.assert_array_equal(vertices, expected)


def test_something_moves_from_the_start(app: App, port: int) -> None:
    begin = time.monotonic()
    with LoopbackClient(port) as client:
        shown = [client.wait_vertices(BODY) for _ in range(2)]
        assert time.monotonic() - begin < 2.0
    assert shown[0] is not None
    assert shown[1] is not None
    assert np.abs(shown[0] - shown[1]).max() > 0.0


def test_a_slow_column_stops_no_scrubbing(drop: Predictor, port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rival = load("mass-elastic/pod-rbf")
    sound = type(rival).solve

    def slow(*asked: Any, **more: Any) -> Any:
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            check_cancelled()
            time.sleep(0.01)
        return sound(*asked, **more)

    monkeypatch.setattr(type(rival), "solve", slow)
    app = App([Column("odeform", drop, drop.rest), Column("slow", rival, rival.rest)], port=port)
    try:
        with LoopbackClient(port) as client:
            client.set("time (s)", 0.3)
            assert client.until(lambda: app.presenter.frame is not None and len(app.presenter.frame.columns) == 2, 20.0)
            client.set("mass (kg)", 0.8)
            times = set()
            for moment in np.linspace(0.27, 0.33, 40):
                client.set("time (s)", float(moment))
                client.collect(0.05)
                assert app.presenter.frame is not None
                times.add(app.presenter.frame.request.time)
            assert app.presenter.frame is not None
            assert app.presenter.frame.pending == ("slow",)
            assert len(times) > 10
            # at rest it joins
            assert client.until(lambda: app.presenter.frame is not None and not app.presenter.frame.pending, 20.0)
    finally:
        app.close()
