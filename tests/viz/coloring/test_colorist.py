"""What colors show, on motions that are formulas."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from stubs import PEAK, StubPredictor, recorded

from odeform.motion.recorded import RecordedMotion
from odeform.types import Mesh, PointCloud
from odeform_viz.coloring.colorist import Colorist
from odeform_viz.columns import Column, Columns
from odeform_viz.session import Session
from odeform_viz.view import Frame, ViewRequest


def _frame(*columns: Column, time: float = PEAK) -> Frame:
    schema = columns[0].source.schema
    request = ViewRequest(schema.complete({"mass": 0.5}), time, "balanced", Columns.of(columns).all)
    return Session(schema).frame(request)


def test_displacement_is_without_the_rigid_motion() -> None:
    stub = StubPredictor()
    frame = _frame(Column("stub", stub, stub.rest))
    coloring = Colorist().color(frame, "displacement")
    assert coloring is not None
    (values,) = coloring.values.values()
    local = stub.solve(None, frame.request.parameters).local(PEAK)
    assert values == pytest.approx(1e3 * np.linalg.norm(local, axis=1), abs=1e-4)
    assert np.quantile(values, 0.99) <= coloring.scale.top
    resting = Colorist().color(_frame(Column("stub", stub, stub.rest), time=0.0), "displacement")
    assert resting is not None
    assert max(value.max() for value in resting.values.values()) == 0.0


def test_strain_is_that_of_meshes_only() -> None:
    stub = StubPredictor()
    mesh, cloud = Column("mesh", stub, stub.rest), Column("cloud", stub, PointCloud(stub.rest.points))
    coloring = Colorist().color(_frame(mesh, cloud), "strain")
    assert coloring is not None
    assert len(coloring.values) == 1
    assert coloring.scale.unit == "%"
    assert Colorist().color(_frame(cloud), "strain") is None


def test_errors_need_a_truth_and_are_carried_to_the_model() -> None:
    stub = StubPredictor()
    record = RecordedMotion(stub.schema, recorded(stub, {"mass": 0.5}))
    model, truth = Column("stub", stub, stub.rest), Column("truth", record, record.geometry)
    assert Colorist().color(_frame(model), "error") is None
    coloring = Colorist().color(_frame(model, truth), "error")
    assert coloring is not None
    (values,) = coloring.values.values()
    assert values == pytest.approx(1.0, abs=1e-2)  # mm, everywhere
    assert coloring.scale.top == pytest.approx(1.0, abs=0.5)
    assert Colorist().color(_frame(model, truth), "own colours") is None


@pytest.mark.parametrize("left", ["own colours", "error"])
def test_nothing_is_kept_of_a_removed_column_or_truth(left: str) -> None:
    stub, colorist = StubPredictor(), Colorist()
    record = RecordedMotion(stub.schema, recorded(stub, {"mass": 0.5}))
    model, truth = Column("stub", stub, stub.rest), Column("truth", record, record.geometry)
    other = Column("other", stub, Mesh(stub.rest.points.copy(), stub.rest.faces))
    frame = _frame(model, truth, other)
    for quantity in ("error", "strain"):
        assert colorist.color(frame, quantity) is not None
    removed = [weakref.ref(record), weakref.ref(other.geometry)]
    colorist.color(_frame(model), left)
    del record, truth, other, frame
    gc.collect()
    assert [reference() for reference in removed] == [None, None]


def test_one_column_far_off_does_not_take_the_colours_of_the_others() -> None:
    stub = StubPredictor()
    record = RecordedMotion(stub.schema, recorded(stub, {"mass": 0.5}))
    truth = Column("truth", record, record.geometry)
    frame = _frame(Column("near", stub, stub.rest), Column("also near", stub, stub.rest), truth)
    near, also, shown = frame.columns
    assert near.error is not None
    bad = replace(near.error, distances=100.0 * near.error.distances)
    spoilt = replace(frame, columns=(near, replace(also, error=bad), shown))
    alone = replace(frame, columns=(replace(near, error=bad), shown))
    tops = [c.scale.top for each in (frame, spoilt, alone) if (c := Colorist().color(each, "error")) is not None]
    assert tops[1] == tops[0]
    assert tops[2] > 50.0 * tops[0]
