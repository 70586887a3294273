"""The loop: what is computed, shown, described and recorded, and in which order. Without server and threads."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from stubs import StubPredictor, recorded

from odeform.cancellation import check_cancelled
from odeform.errors import InputError
from odeform.motion.recorded import RecordedMotion
from odeform_viz import session as session_module
from odeform_viz.columns import Column, Columns
from odeform_viz.presenter import DESCRIBE, SETTLE, TICK, Presenter
from odeform_viz.runtime.clock import Clock
from odeform_viz.session import Session
from odeform_viz.view import Coloring, Description, DisplayOptions, Frame, ViewRequest


@dataclass
class Loop:
    """A presenter with its collaborators: what they received, and what they show."""

    request: ViewRequest
    session: Session
    clock: Clock
    options: DisplayOptions = field(default_factory=DisplayOptions)
    up_to_date: Callable[[], bool] = lambda: True
    starts: bool = False
    events: list[tuple[str, Any]] = field(default_factory=list)
    outdated: int = 0

    def __post_init__(self) -> None:
        self.presenter = Presenter(
            self.session, self.clock, lambda: (self.request, self.options), self, self, lambda: self.up_to_date()
        )

    def serve(self) -> float | None:
        self.events.clear()
        return self.presenter.serve()

    def ask(self, **changes: Any) -> None:
        self.request = replace(self.request, **changes)

    @property
    def kinds(self) -> list[str]:
        return [kind for kind, _ in self.events]

    def publish(self, frame: Frame, options: DisplayOptions, coloring: Coloring | None) -> None:
        self.events.append(("publish", coloring))

    def describe(self, description: Description) -> None:
        self.events.append(("describe", description))

    def outdate(self) -> None:
        self.outdated += 1

    def show_error(self, message: str) -> None:
        self.events.append(("error", message))

    def settle(self) -> None:
        self.events.append(("settle", None))

    def sync(self) -> bool:
        return self.starts

    def log(self, frame: Frame) -> None:
        check_cancelled()
        self.events.append(("log", frame.request.time))


@pytest.fixture
def models() -> tuple[StubPredictor, StubPredictor]:
    return StubPredictor(), StubPredictor()


@pytest.fixture
def loop(models: tuple[StubPredictor, ...]) -> Loop:
    return _loop([Column(f"model {i}", m, m.rest) for i, m in enumerate(models)])


def _loop(columns: list[Column]) -> Loop:
    schema, shown = columns[0].source.schema, Columns.of(columns).all
    return Loop(ViewRequest(schema.complete({}), 0.2, "balanced", shown), Session(schema), Clock(0.0, 1.0))


def test_a_request_is_shown_then_described_completely_then_nothing_is_left(loop: Loop) -> None:
    assert loop.serve() == SETTLE
    assert loop.kinds == ["publish", "log", "describe"]
    assert not loop.presenter.settled
    assert loop.serve() is None
    assert loop.kinds == ["describe", "settle"]
    assert loop.presenter.settled
    assert loop.serve() is None
    assert loop.kinds == []


def test_the_solver_error_is_left_until_the_view_has_settled(loop: Loop) -> None:
    loop.serve()
    assert not loop.events[-1][1].settled
    loop.serve()
    assert loop.events[0][1].settled
    loop.ask(time=0.3)  # the same motions: nothing new to wait for
    loop.serve()
    assert loop.presenter._settled


def test_while_playing_the_next_frame_is_due_after_a_tick(loop: Loop) -> None:
    loop.clock.play()
    assert loop.serve() == TICK


def test_a_long_first_description_does_not_hold_up_those_of_later_moments(
    loop: Loop, monkeypatch: pytest.MonkeyPatch
) -> None:
    wall, took = [0.0], [0.9]
    monkeypatch.setattr("odeform_viz.presenter.time.monotonic", lambda: wall[0])
    described = loop.describe

    def describe(description: Description) -> None:
        described(description)
        wall[0] += took[0]

    loop.describe = describe  # type: ignore[method-assign]
    for _ in range(4):
        loop.serve()  # until the motion is described completely
    took[0] = 0.0
    wall[0] += 1.5 * DESCRIBE
    loop.ask(time=0.3)
    loop.serve()
    assert "describe" in loop.kinds
    took[0] = 0.9
    wall[0] += 1.5 * DESCRIBE
    loop.ask(time=0.31)
    loop.serve()
    wall[0] += 1.5 * DESCRIBE
    loop.ask(time=0.32)
    loop.serve()
    assert "describe" not in loop.kinds, "one that takes long each time is rare"


def test_a_newer_request_cancels_the_one_being_computed(loop: Loop, models: tuple[StubPredictor, ...]) -> None:
    models[1].delay, loop.up_to_date = check_cancelled, lambda: False
    assert loop.serve() == 0.0
    assert loop.kinds == []
    loop.up_to_date = lambda: True
    assert loop.serve() == 0.0  # the column that was given up is taken to be slow
    assert loop.presenter.frame is not None
    assert loop.presenter.frame.pending == ("model 1",)
    loop.serve()
    assert not loop.presenter.frame.pending


def test_slow_columns_follow_the_others(loop: Loop, monkeypatch: pytest.MonkeyPatch) -> None:
    while loop.serve() is not None:
        pass
    monkeypatch.setattr(session_module, "SLOW", 0.0)
    loop.ask(parameters={**loop.request.parameters, "mass": 0.5})
    assert loop.serve() == 0.0
    frame = loop.presenter.frame
    assert frame is not None
    assert frame.pending == ("model 1",)
    loop.ask(time=0.3)
    loop.serve()
    assert loop.presenter.frame is not None
    assert loop.presenter.frame.pending == frame.pending  # another time: still scrubbing
    loop.serve()
    assert loop.presenter.frame is not None
    assert not loop.presenter.frame.pending


def test_a_request_that_cannot_be_met_is_named_and_the_next_one_is_shown(loop: Loop) -> None:
    loop.serve()
    good = loop.request
    loop.ask(time=-1.0)
    assert loop.serve() is None
    assert loop.events == [("error", "time: expected seconds from 0 on, got -1.0")]
    loop.request = good
    loop.serve()
    assert "publish" in loop.kinds


def test_errors_of_reading_the_request_are_shown_too(loop: Loop, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> Any:
        raise InputError("mass: no")

    monkeypatch.setattr(loop.presenter, "_read", refuse)
    assert loop.serve() is None
    assert loop.events == [("error", "mass: no")]


def test_a_recording_that_starts_gets_the_current_frame(loop: Loop) -> None:
    loop.serve()
    loop.serve()
    loop.starts = True
    loop.serve()
    assert ("log", 0.2) in loop.events


def test_a_frame_that_was_shown_is_recorded_even_if_it_is_no_longer_wanted(loop: Loop) -> None:
    answers = iter([True] * 50)
    loop.up_to_date = lambda: next(answers, False) and "publish" not in loop.kinds
    loop.serve()
    assert loop.kinds[:2] == ["publish", "log"]


def test_the_scale_is_that_of_the_errors_and_none_without_colours() -> None:
    model = StubPredictor()
    record = RecordedMotion(model.schema, recorded(model, {"mass": 0.5}))
    loop = _loop([Column("stub", model, model.rest), Column("truth", record, record.geometry)])
    loop.ask(parameters=model.schema.complete({"mass": 0.5}))
    loop.serve()
    assert loop.presenter.scale is not None
    assert 1.0 <= loop.presenter.scale.top <= 1.5  # mm; the error is 1 mm along z
    for options in (DisplayOptions(color_by="own colours"), DisplayOptions(overlay=True)):
        loop.options = options
        loop.serve()
        assert loop.presenter.scale is None


def test_the_scale_of_colors_is_that_of_the_whole_motion_once_it_has_settled(
    loop: Loop, models: tuple[StubPredictor, ...]
) -> None:
    loop.options = DisplayOptions(color_by="displacement")
    loop.ask(time=0.02)
    loop.serve()
    assert loop.presenter.scale is not None
    assert loop.presenter.scale.momentary
    small = loop.presenter.scale.top
    loop.serve()
    scale = loop.presenter.scale
    assert not scale.momentary
    assert loop.kinds.count("publish") == 1  # the same frame, on the new scale
    motion = models[0].solve(None, loop.request.parameters)
    largest = 1e3 * max(np.linalg.norm(motion.local(t), axis=1).max() for t in np.linspace(0.0, 1.0, 50))
    assert small < 0.5 * largest <= scale.top <= 1.5 * largest
    for time in (0.1, 0.25, 0.9):
        loop.ask(time=time)
        loop.serve()
        assert loop.presenter.scale is scale
    loop.options = DisplayOptions(color_by="displacement", momentary=True)
    loop.serve()
    assert loop.presenter.scale.momentary


def test_what_is_beside_the_view_is_outdated_by_other_motions_not_by_other_moments(loop: Loop) -> None:
    loop.serve()
    loop.ask(time=0.4)
    loop.serve()
    assert loop.outdated == 0
    loop.ask(parameters={**loop.request.parameters, "mass": 0.5})
    loop.serve()
    assert loop.outdated == 1
