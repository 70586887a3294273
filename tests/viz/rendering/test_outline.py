"""Bodies are seen from near, also those that fall from high up."""

import math

import numpy as np
import pytest
import viser
from test_framing import project

import odeform
from odeform.models.base import Predictor
from odeform_viz.columns import Column, Columns
from odeform_viz.obstacles import obstacles_of
from odeform_viz.rendering.framing import Axes, Viewport, free_area
from odeform_viz.rendering.outline import RISE, ceiling_of, outline_of
from odeform_viz.rendering.scene import SceneView
from odeform_viz.session import Session
from odeform_viz.view import ColumnFrame, DisplayOptions, Frame, ViewRequest

TWO_THIRDS = 2.0 / 3.0


def shown(predictor: Predictor, time: float) -> Frame:
    columns = Columns.of([Column("body", predictor, predictor.rest)]).all
    parameters = predictor.schema.complete(predictor.complete({}))
    return Session(predictor.schema).frame(ViewRequest(parameters, time, "balanced", columns))


def size_of(column: ColumnFrame) -> float:
    return float(np.ptp(column.column.geometry.points, axis=0).max())


@pytest.mark.parametrize("name", ["mass-elastic", "contact-force:drop", "contact-force:throw", "kick"])
def test_a_body_fills_two_thirds_of_what_is_free_wherever_it_is(name: str) -> None:
    (column,) = shown(odeform.load(name), 0.0).columns
    box = outline_of(column, Axes.beside(None), False, RISE * size_of(column))
    assert TWO_THIRDS * (box.high - box.low) < 1.1 * size_of(column)


@pytest.mark.parametrize("time", [0.0, 0.1, 0.25])
def test_a_fall_is_followed_down_to_what_is_framed(server: viser.ViserServer, time: float) -> None:
    frame, view = shown(odeform.load("mass-elastic"), time), SceneView(server, 0.2, lambda: None)
    (column,) = frame.columns
    view.publish(frame, DisplayOptions(), None)
    centre = column.pose[:3, :3] @ np.asarray(column.column.geometry.points).mean(axis=0) + column.pose[:3, 3]
    ceiling = ceiling_of(column, RISE * size_of(column))
    assert centre[2] + view._stage.position[2] == pytest.approx(min(centre[2], ceiling), abs=1e-3)
    view.publish(frame, DisplayOptions(follow=False), None)
    assert view._stage.position == pytest.approx(np.zeros(3))


@pytest.mark.parametrize("viewport", [(1280, 760), (1440, 900), (390, 844)])
@pytest.mark.parametrize("load", ["wall", "step", "slope"])
def test_panels_cover_no_part_of_an_obstacle(server: viser.ViserServer, load: str, viewport: Viewport) -> None:
    frame, view = shown(odeform.load(f"contact-force:{load}"), 0.0), SceneView(server, 0.2, lambda: None)
    view.publish(frame, DisplayOptions(viewport=viewport), None)
    (obstacle,) = obstacles_of(frame.columns[0].motion)
    pixels = project(obstacle.mesh.points, view._framing.camera(viewport), viewport)
    left, top, right, bottom = free_area(viewport)
    assert (pixels >= (left, top)).all()
    assert (pixels <= (right, bottom)).all()


def test_the_whole_height_is_framed_where_nothing_is_followed() -> None:
    (column,) = shown(odeform.load("mass-elastic"), 0.0).columns
    whole = outline_of(column, Axes.beside(None), False)
    assert whole.high - whole.low > 1.5 * size_of(column)
    assert ceiling_of(column, math.inf) > ceiling_of(column, RISE * size_of(column))


def test_a_line_of_text_over_the_scene_leaves_less_of_it_free() -> None:
    for viewport in ((1440, 900), (390, 844)):
        assert free_area(viewport, noted=True)[1] > free_area(viewport)[1]
