"""The running viewer, seen through its protocol."""

import time

import numpy as np
import pytest
from stubs import StubPredictor

from odeform import InputError
from odeform.cancellation import check_cancelled
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column
from odeform_viz.rendering.checkerboard import checkerboard_parts
from odeform_viz.view import Frame

View = tuple[App, LoopbackClient]
BODY = "/world/column_0/body/part_0"


def _frame(app: App) -> Frame:
    frame = app.presenter.frame
    assert frame is not None
    return frame


def _expected(parameters: dict[str, float], time: float) -> np.ndarray:
    """The vertices of `BODY`."""
    stub = StubPredictor()
    return checkerboard_parts(stub.rest)[0].vertices(stub.solve(stub.rest, parameters).deformed(time))


def _last_vertices(client: LoopbackClient, expected: np.ndarray) -> np.ndarray:
    """The newest vertices once they are as expected, or what came last in a second without any."""
    last = np.zeros_like(expected)
    while (vertices := client.wait_vertices(BODY, 1.0)) is not None:
        last = vertices
        if np.array_equal(last, expected):
            break
    return last


def test_it_has_the_sliders_of_the_scene(stubbed: View) -> None:
    _, client = stubbed
    assert {"mass (kg)", "spring (N/m)", "time (s)"} <= set(client.controls)


def test_it_opens_playing_until_the_user_moves_the_time(port: int) -> None:
    stub = StubPredictor()
    app = App([Column("stub", stub, stub.rest)], port=port)
    try:
        with LoopbackClient(port) as client:
            first, second = client.wait_vertices(BODY), client.wait_vertices(BODY)
            assert first is not None
            assert second is not None
            assert np.abs(first - second).max() > 0.0
            assert app.clock.playing
            client.set("time (s)", 0.5)
            assert client.until(lambda: not app.clock.playing)
            assert app.clock.time() == pytest.approx(0.5)
    finally:
        app.close()


def test_a_slider_moves_the_mesh(stubbed: View) -> None:
    _, client = stubbed
    client.set("spring (N/m)", 4.0)
    expected = _expected({"spring": 4.0}, 0.2)
    np.testing.assert_array_equal(_last_vertices(client, expected), expected)


def test_after_many_messages_the_last_request_is_shown(stubbed: View) -> None:
    _, client = stubbed
    values = np.linspace(1.1, 4.9, 150)
    for value in values:
        client.set("spring (N/m)", float(value))
    expected = _expected({"spring": float(values[-1])}, 0.2)
    np.testing.assert_array_equal(_last_vertices(client, expected), expected)


def test_values_that_no_slider_has_keep_the_last_frame_and_say_why(stubbed: View) -> None:
    app, client = stubbed
    before = len(app.columns.all[0].source.solved)  # pyright: ignore[reportAttributeAccessIssue]
    client.set("mass (kg)", float("nan"))
    assert client.until(lambda: "expected a finite number" in client.text())
    assert len(app.columns.all[0].source.solved) == before  # pyright: ignore[reportAttributeAccessIssue]
    client.set("mass (kg)", 0.7)  # as before: the message goes
    assert client.until(lambda: "expected a finite number" not in client.text())
    client.set("quality", "nonsense")
    assert client.until(lambda: "quality: expected one of draft, balanced" in client.text())
    client.set("quality", "draft")
    assert client.until(lambda: "quality: expected" not in client.text())


def test_outside_the_trained_range_the_page_says_so(stubbed: View) -> None:
    _, client = stubbed
    client.set("time (s)", 1.2)
    client.set("mass (kg)", 1.1)
    assert client.until(lambda: "time and mass beyond the trained range" in client.text())


def test_a_port_in_use_is_refused(stubbed: View, port: int) -> None:
    stub = StubPredictor()
    with pytest.raises(InputError, match=str(port)):
        App([Column("stub", stub, stub.rest)], port=port)


def test_two_users_of_one_slider_see_the_newest_value(stubbed: View, port: int) -> None:
    _, one = stubbed
    with LoopbackClient(port) as two:
        for value in np.linspace(1.5, 4.0, 20):
            one.set("spring (N/m)", float(value))
            two.set("spring (N/m)", float(value) + 0.1)
        # a client is not told of its own values, so one that sends while another's value is on its way keeps the older
        one.set("mass (kg)", 0.75)
        assert two.until(lambda: two.controls["mass (kg)"].value == 0.75)  # the server has all that one sent
        two.set("spring (N/m)", 3.85)  # as it never was before
        assert one.until(lambda: one.controls["spring (N/m)"].value == 3.85)  # and one has all that two sent
        expected = _expected({"mass": 0.75, "spring": 2.25}, 0.2)
        one.set("spring (N/m)", 2.25)
        for client in (one, two):
            np.testing.assert_array_equal(_last_vertices(client, expected), expected)
            assert client.until(lambda client=client: client.controls["spring (N/m)"].value == 2.25)


def test_a_slow_column_does_not_slow_down_scrubbing(serve) -> None:
    fast, slow = StubPredictor(), StubPredictor()
    app, client = serve(Column("fast", fast, fast.rest), Column("slow", slow, slow.rest), moment=0.2)

    def wait() -> None:
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            check_cancelled()
            time.sleep(0.01)

    slow.delay = wait
    # the first new motion shows that it is slow
    client.set("mass (kg)", 0.8)
    assert client.until(lambda: app.presenter.settled and _frame(app).request.parameters["mass"] == 0.8)
    client.set("mass (kg)", 0.9)
    for value in (0.21, 0.22, 0.23):
        client.set("time (s)", value)
        assert client.until(lambda value=value: _frame(app).request.time == value)
        assert _frame(app).pending == ("slow",)
    assert client.until(lambda: not _frame(app).pending)
    assert [column.column.label for column in _frame(app).columns] == ["fast", "slow"]
