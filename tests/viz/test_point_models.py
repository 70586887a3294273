"""Models of points in the viewer's session, beside the others and the truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.cancellation import Cancelled, cancel_unless
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.motion.point_motion import PointMotion
from odeform.motion.recorded import RecordedMotion
from odeform_viz.columns import Column, Columns
from odeform_viz.panels.summary import summarize
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest


@pytest.fixture(scope="module")
def models(point_models: dict[str, Path]) -> dict[str, Predictor]:
    return {name: load(path) for name, path in point_models.items()}


@pytest.fixture(scope="module")
def truth(dataset: Dataset) -> RecordedMotion:
    return RecordedMotion(dataset.schema, next(dataset.sequences("test")))


def test_all_side_by_side_with_the_truth(models: dict[str, Predictor], truth: RecordedMotion) -> None:
    shown = [Column("truth", truth, truth.geometry), *(Column(name, p, p.rest) for name, p in models.items())]
    columns = Columns.of(shown).all
    session = Session(truth.schema)
    request = ViewRequest(session.schema.complete(truth.parameters), 0.4, "balanced", columns)
    frame = session.frame(request)
    for column in frame.columns[1:]:
        assert isinstance(column.motion, PointMotion)
        assert column.error is not None
        assert column.stats.status == "ok"
        curves = session.curves(column, request)
        assert np.isfinite(curves.deformation).all()
        assert curves.error_band is None, "fewer than eight validation sequences tell nothing of nine in ten"
        assert session.frame(request).columns[1].motion is frame.columns[1].motion


def test_between_frames_needs_a_truth_of_these_parameters(models: dict[str, Predictor], truth: RecordedMotion) -> None:
    flow = Column("flow", models["occupancy-flow"], models["occupancy-flow"].rest)
    session = Session(truth.schema)
    with pytest.raises(InputError, match="expected a truth"):
        session.frame(ViewRequest(session.schema.complete({}), 0.4, "balanced", Columns.of([flow]).all))
    both = Columns.of([Column("truth", truth, truth.geometry), flow]).all
    frame = session.frame(ViewRequest(session.schema.complete({"mass": 0.55}), 0.4, "balanced", both))
    assert [shown.column.label for shown in frame.columns] == ["truth"]  # one that refuses stops no other
    assert frame.refused == ("flow interpolates observed frames: expected a truth of these parameters",)
    assert "flow interpolates observed frames" in summarize(frame)


def test_who_takes_long_holds_up_no_other(models: dict[str, Predictor], monkeypatch: pytest.MonkeyPatch) -> None:
    kick = load("kick")
    fast, slow = Column("fast", kick, kick.rest), Column("node", models["node"], models["node"].rest)
    session = Session(kick.schema)
    columns = Columns.of([fast, slow]).all
    request = ViewRequest(session.schema.complete({"mass": 0.5}), 0.4, "balanced", columns)
    asked = iter([True] * 10)
    with pytest.raises(Cancelled), cancel_unless(lambda: next(asked, False)):  # a newer request comes meanwhile
        session.frame(request, include_slow=False)
    # what was given up is left for later, and the page says so
    first = session.frame(request, include_slow=False)
    assert [shown.column.label for shown in first.columns] == ["fast"]
    assert first.pending == ("node",)
    assert "node is being computed" in summarize(first)
    assert first.differs_in_time_only(replace(request, time=0.5))
    whole = session.frame(request)
    assert [shown.column.label for shown in whole.columns] == ["fast", "node"]
    assert not whole.pending
    # once there, it is shown at any time
    assert not session.frame(replace(request, time=0.5), include_slow=False).pending
    monkeypatch.setattr("odeform_viz.session.SLOW", 0.0)
    moved = replace(request, parameters={**request.parameters, "mass": 0.6})
    assert not first.differs_in_time_only(moved)
    # the motion that took least is slow now too
    assert session.frame(moved, include_slow=False).pending == ("node",)
