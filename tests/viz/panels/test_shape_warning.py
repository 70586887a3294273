"""A shape that was not trained is announced with its first frame, without any figure of the trained body's error."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from stubs import StubPredictor

from odeform.geometry.shape import FittedShape, fit_to
from odeform.geometry.shape_similarity import ShapeSimilarity
from odeform.models.base import Predictor
from odeform.types import Mesh
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column, Columns
from odeform_viz.panels.shape import ShapePanel
from odeform_viz.panels.shape_warning import ShapeWarningPanel, shape_warning
from odeform_viz.panels.status import describe_column
from odeform_viz.panels.summary import badge_of, summarize
from odeform_viz.rendering.titles import title_of
from odeform_viz.session import Session
from odeform_viz.view import Frame, ViewRequest

Serve = Callable[..., tuple[App, LoopbackClient]]
SHAPES = {
    "box": trimesh.creation.box((1.0, 1.0, 1.0)),
    "torus": trimesh.creation.torus(1.0, 0.3),
    "plate": trimesh.creation.cylinder(1.0, 0.1),
    "bottle": trimesh.creation.capsule(3.0, 1.0),
}


def fitted(name: str, body: Mesh) -> FittedShape:
    shape = SHAPES[name] if name in SHAPES else trimesh.creation.icosphere(4)
    return fit_to(Mesh(np.asarray(shape.vertices, np.float32), np.asarray(shape.faces, np.int32)), body)


def shown(kick: Predictor, name: str, time: float = 0.05) -> Frame:
    fit = fitted(name, kick.rest)
    columns = Columns.of([Column("odeform", kick, fit.geometry, fit=fit)]).all
    session = Session(kick.schema)
    return session.frame(ViewRequest(kick.schema.complete(None), time, "balanced", columns))


@pytest.mark.parametrize("name", SHAPES)
def test_no_figure_of_the_trained_body_is_shown_for_another_shape(kick: Predictor, name: str) -> None:
    frame = shown(kick, name)
    (column,) = frame.columns
    assert column.untrained
    assert column.error_band(np.array([0.5])) is None
    curves = Session(kick.schema).curves(column, frame.request)
    assert curves.error is None
    assert curves.error_band is None
    said = describe_column(column, 0.05)
    assert "error expected: not known, this shape was not trained" in said
    assert "test error" not in said
    assert "90 %" not in said
    assert "shape not trained" in summarize(frame)
    assert badge_of(frame).level == "unknown"
    assert "no error estimate" in badge_of(frame).expected
    assert "shape not trained" in title_of(column, 1e3)


def test_the_same_shape_keeps_its_figures(kick: Predictor) -> None:
    frame = shown(kick, "ball")
    (column,) = frame.columns
    assert not column.untrained
    assert "error expected here: half below" in describe_column(column, 0.05)
    assert "inside the trained range" in summarize(frame)
    assert "not trained" not in summarize(frame) + title_of(column, 1e3)


def test_the_warning_gives_the_distance_and_is_empty_without_a_reason() -> None:
    same, near, far = (
        ShapeSimilarity(1e-3, 1e-3, 4e-3),
        ShapeSimilarity(0.03, 0.012, 4e-3),
        ShapeSimilarity(0.128, 0.071, 4e-3),
    )
    assert shape_warning([None, same]) == ""
    text = shape_warning([near, same, far, None])
    assert "on average 71 mm" in text
    assert "The largest distance is 128 mm" in text


def test_it_is_there_before_a_frame_of_the_shape_and_goes_with_it(stubbed: tuple[App, LoopbackClient]) -> None:
    app, client = stubbed
    panel = app.panel(ShapeWarningPanel)
    assert "Shape not trained" not in panel._box.content
    app.panel(ShapePanel).set(replace(fitted("torus", app.page.body), origin="torus.obj"))
    assert "Shape not trained" in panel._box.content  # at once: the worker has not even been told of the shape
    assert client.until(lambda: app.presenter.frame is not None and app.presenter.frame.columns[0].untrained)
    assert client.until(lambda: app.presenter.settled)
    assert "Shape not trained" in panel._box.content
    app.panel(ShapePanel).set(None)
    assert "Shape not trained" not in panel._box.content


def test_a_page_that_starts_with_such_a_shape_warns_from_the_start(serve: Serve) -> None:
    stub = StubPredictor()
    fit = fitted("box", stub.rest)
    app, _ = serve(Column("stub", stub, fit.geometry, fit=fit))
    assert app.panel(ShapeWarningPanel)._box.visible
