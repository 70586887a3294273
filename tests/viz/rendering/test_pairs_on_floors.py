"""Two bodies that meet stay on the floor of their column."""

import numpy as np
import pytest
import viser

import odeform
from odeform.models.base import Predictor
from odeform.schema import Parameters
from odeform.types import Floats
from odeform_viz.columns import Column, Columns
from odeform_viz.rendering.scene import SceneView
from odeform_viz.session import Session
from odeform_viz.view import DisplayOptions, Frame, ViewRequest


@pytest.fixture(scope="module")
def model() -> Predictor:
    return odeform.load("contact-force:meet")


def beside(model: Predictor, parameters: Parameters, time: float, session: Session, columns: Columns) -> Frame:
    columns.follow(model.complete(parameters))
    return session.frame(ViewRequest(model.complete(parameters), time, "balanced", columns.all))


def farthest(view: SceneView, frame: Frame) -> Floats:
    """(columns,) m along the floor, from the middle of the floor under each column."""
    out = []
    for shown in frame.columns:
        drawn = view._views[shown.column.key][1]
        pose = drawn.placement(shown)
        points = drawn.points(shown, DisplayOptions()) @ pose[:3, :3].T + pose[:3, 3]
        out.append(np.hypot(*(points - drawn.offset)[:, :2].T).max())
    return np.array(out)


def test_both_bodies_stay_on_their_floor_also_when_sliders_part_them(
    server: viser.ViserServer, model: Predictor
) -> None:
    columns = Columns.of([Column(name, model, model.rest) for name in ("one", "other")])
    session, view = Session(model.schema), SceneView(server, 0.2, lambda: None)
    for asked in ({"object": "donut", "distance": 0.35}, {"object": "donut", "distance": 0.6, "spin_y": 0.0}):
        for time in (0.0, 0.1, 0.3, 0.8):
            frame = beside(model, asked, time, session, columns)
            view.publish(frame, DisplayOptions(), None)
            discs = [view._views[shown.column.key][1]._disc for shown in frame.columns]
            assert (farthest(view, frame) <= [disc.radius for disc in discs if disc is not None]).all(), (asked, time)


def test_the_arrow_of_a_throw_begins_at_the_body_that_is_thrown(server: viser.ViserServer, model: Predictor) -> None:
    columns = Columns.of([Column("one", model, model.rest)])
    session, view = Session(model.schema), SceneView(server, 0.2, lambda: None)
    frame = beside(model, {"object": "donut"}, 0.0, session, columns)
    view.publish(frame, DisplayOptions(), None)
    (shown,) = frame.columns
    arrows = server.scene.get_handle_by_name(f"/world/column_{shown.column.key}/ground/arrows")
    assert isinstance(arrows, viser.ArrowsHandle)
    points = shown.motion.vertices(0.0)
    thrown = points[: len(points) // 2]
    assert np.linalg.norm(arrows.points[0, 0] - thrown.mean(axis=0)) < np.ptp(thrown, axis=0).max()
