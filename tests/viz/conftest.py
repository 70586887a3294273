"""Recordings made without a browser."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from odeform_viz.columns import Column, Columns
from odeform_viz.recorder import Recorder
from odeform_viz.session import Frame, Session, Wish

Record = Callable[..., list[Frame]]


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
        recorder = Recorder(path)
        wishes = [Wish(schema.complete(parameters or {"mass": 0.4}), time, "balanced", shown) for time in times]
        frames = [change(session.frame(wish)) for wish in wishes]
        for frame in frames:
            recorder.log(frame)
        recorder.close()
        return frames

    return make
