"""Curves over time."""

import re
from dataclasses import replace

import numpy as np
import pytest

from odeform.models.base import Predictor
from odeform_viz.app import App
from odeform_viz.benchmark.client import LoopbackClient
from odeform_viz.columns import Column, Columns
from odeform_viz.panels.playback import PlaybackPanel
from odeform_viz.panels.plots import PlotPanel
from odeform_viz.panels.plots_svg import Line, cursor_svg, plots_svg
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest


@pytest.fixture(scope="module")
def line(drop: Predictor) -> Line:
    session, columns = Session(drop.schema), Columns.of([Column("odeform", drop, drop.rest)]).all
    request = ViewRequest(session.schema.complete({}), 0.3, "balanced", columns)
    return ("odeform", (206, 78, 26), session.curves(session.frame(request).columns[0], request))


def test_there_is_a_plot_a_quantity_and_a_path_a_line(line: Line, drop: Predictor) -> None:
    line = (*line[:2], replace(line[2], error_band=None))
    svg = plots_svg([line, line], drop.schema.window, rotates=False)
    assert re.findall(r"height of the centre|rotation, degrees|deformation RMS|error RMS", svg) == [
        "height of the centre",
        "deformation RMS",
    ]
    assert svg.count('stroke="rgb(206, 78, 26)"') == 4
    assert "rotation, degrees" in plots_svg([line], drop.schema.window, rotates=True)


def test_an_error_is_plotted_with_gaps_where_the_truth_has_ended(line: Line, drop: Predictor) -> None:
    error = np.linspace(0.0, 2.0, len(line[2].times))
    error[50:] = np.nan
    svg = plots_svg([(*line[:2], replace(line[2], error=error))], drop.schema.window, rotates=False)
    assert "error RMS, mm" in svg
    assert "nan" not in svg
    cursor = cursor_svg([(*line[:2], replace(line[2], error=error))], drop.schema.window, False, 1.0)
    assert "–" in cursor


def test_the_expected_error_is_dashed(line: Line, drop: Predictor) -> None:
    """The model's own truth apart: it is there without any."""
    assert line[2].error is None
    assert plots_svg([line], drop.schema.window, rotates=False).count("stroke-dasharray") == 1


def test_nothing_shown_is_nothing_drawn(drop: Predictor) -> None:
    assert "<path d=" in plots_svg([], drop.schema.window, rotates=False)
    assert "<text" not in cursor_svg([], drop.schema.window, False, 0.3)


def test_curves_are_sent_once_a_motion_and_the_moment_always(dropped: tuple[App, LoopbackClient]) -> None:
    app, client = dropped
    curves, cursor = app.panel(PlotPanel)._curves.content, app.panel(PlotPanel)._cursor.content
    client.set("time (s)", 0.5)
    assert client.until(lambda: app.panel(PlotPanel)._cursor.content != cursor)
    assert app.panel(PlotPanel)._curves.content == curves
    client.set("mass (kg)", 0.9)
    assert client.until(lambda: app.panel(PlotPanel)._curves.content != curves)
    client.set("odeform", False)
    assert client.until(lambda: "no column is visible" in client.text())


def test_after_many_moments_the_numbers_are_of_the_last(dropped: tuple[App, LoopbackClient]) -> None:
    """They are sent ten times a second, however often the moment changes."""
    app, client = dropped
    for moment in np.linspace(0.3, 0.45, 31):
        client.set("time (s)", round(float(moment), 3))
    plots = app.panel(PlotPanel)
    last = cursor_svg(plots._lines, app.session.schema.window, plots._rotates, 0.45)
    assert client.until(lambda: plots._cursor.content == last)
    assert client.until(lambda: app.panel(PlaybackPanel)._time.value == 0.45)
