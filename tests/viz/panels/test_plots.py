"""Curves over time."""

import re
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import replace

import numpy as np
import pytest

from odeform.dataset.store import open_dataset
from odeform.models.base import Predictor
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column, Columns, truth_column
from odeform_viz.panels.playback import PlaybackPanel
from odeform_viz.panels.plot_legend import legend_html, values_html
from odeform_viz.panels.plots import PlotPanel
from odeform_viz.panels.plots_svg import WIDE, Line, cursor_css, plots_html, quantities_of
from odeform_viz.panels.status import describe_column
from odeform_viz.panels.summary import summarize
from odeform_viz.rendering.titles import title_of
from odeform_viz.session import Session
from odeform_viz.view import REACH, ViewRequest


@pytest.fixture(scope="module")
def line(drop: Predictor) -> Line:
    session, columns = Session(drop.schema), Columns.of([Column("odeform", drop, drop.rest)]).all
    request = ViewRequest(session.schema.complete({}), 0.3, "balanced", columns)
    return ("odeform", (206, 78, 26), session.curves(session.frame(request).columns[0], request))


def test_there_is_a_plot_per_quantity_and_a_curve_per_column(line: Line, drop: Predictor) -> None:
    line = (*line[:2], replace(line[2], error_band=None))
    html = plots_html([line, line], drop.schema.window, rotates=False)
    assert re.findall(r"height of the centre|rotation, °|deformation, RMS|error, RMS", html) == [
        "height of the centre",
        "deformation, RMS",
    ]
    assert html.count('stroke="rgb(206, 78, 26)"') == 4
    assert "rotation, °" in plots_html([line], drop.schema.window, rotates=True)


def test_an_error_is_plotted_with_gaps_where_the_truth_has_ended(line: Line, drop: Predictor) -> None:
    error = np.linspace(0.0, 2.0, len(line[2].times))
    error[50:] = np.nan
    html = plots_html([(*line[:2], replace(line[2], error=error))], drop.schema.window, rotates=False)
    assert "error (dashed" in html
    assert "nan" not in html


def test_the_expected_error_is_dashed(line: Line, drop: Predictor) -> None:
    """It is there without a truth."""
    assert line[2].error is None
    assert plots_html([line], drop.schema.window, rotates=False).count("stroke-dasharray") == 1


def test_the_trained_window_sets_the_axis_and_the_rest_is_cut_off(line: Line, drop: Predictor) -> None:
    window = drop.schema.window
    height = np.where(line[2].times <= window.stop, 0.4, 130.0)
    html = plots_html([(*line[:2], replace(line[2], height=height, error_band=None))], window, rotates=False)
    assert ">0.5</text>" in html
    assert "↑ 130" in html
    assert html.count("↑") == 1
    # it leaves its frame, which hides the rest: no plateau at the edge
    drawn = html.split("height of the centre")[1].split("</svg>")[0]
    assert drawn.index("<svg width=") < drawn.index('class="curve"')
    assert min(float(v) for v in re.findall(r"[ML][\d.]+ (-?[\d.]+)", drawn)) < -100.0


def test_a_truth_that_is_over_has_no_curves(drop: Predictor) -> None:
    truth = truth_column(f"mass-elastic/{open_dataset('mass-elastic').select('test')[0].name}")
    assert truth.truth is not None
    assert truth.truth.rests, "the drop ends because the ball lies still"
    falling = replace(truth.truth, sequence=truth.truth.sequence.until(0.5))
    columns = Columns.of([Column("odeform", drop, drop.rest), replace(truth, source=falling)]).all
    session, request = (
        Session(drop.schema),
        ViewRequest(drop.schema.complete(falling.parameters), 0.3, "balanced", columns),
    )
    frame = session.frame(request)
    curves = session.curves(frame.columns[1], request)
    over = curves.times > falling.end
    assert over.any()
    for values in (curves.height, curves.rotation, curves.deformation):
        assert np.isnan(values[over]).all()
        assert np.isfinite(values[~over]).all()
    line = ("truth", (0, 0, 0), curves)
    assert "nan" not in plots_html([line], drop.schema.window, rotates=True)
    late = float(curves.times[-1])
    assert "nan" not in values_html(frame.columns[1:], [line], quantities_of([line], True), late)
    assert "no truth after" in summarize(session.frame(replace(request, time=late)))


def test_an_axis_reaches_below_zero_where_a_curve_does(line: Line, drop: Predictor) -> None:
    sunk = replace(line[2], height=-0.3 * np.ones_like(line[2].times))
    assert ">-0.3</text>" in plots_html([(*line[:2], sunk)], drop.schema.window, rotates=False)
    times = line[2].times
    for dip, shown in ((0.001, False), (0.02, True)):
        dips = replace(line[2], height=np.where(times > 0.2, 0.3, -dip))
        html = plots_html([(*line[:2], dips)], drop.schema.window, rotates=False)
        assert (f">-{dip:g}</text>" in html) == shown


def test_a_dashed_line_is_named_where_there_is_one(line: Line) -> None:
    name, color, curves = line
    known = replace(curves, error=curves.height)
    for band, title in ((None, "error"), (curves.height, "error (dashed: expected)")):
        quantities = quantities_of([(name, color, replace(known, error_band=band))], False)
        assert quantities[-1].title == title


def test_nothing_shown_is_nothing_drawn(drop: Predictor) -> None:
    assert 'class="curve"' not in plots_html([], drop.schema.window, rotates=False)
    assert "<i " not in legend_html([], large=False)


def test_the_cursor_stands_at_the_time(drop: Predictor) -> None:
    window = drop.schema.window
    half = cursor_css(window, window.start + 0.5 * REACH * (window.stop - window.start))
    assert f"translateX({0.5 * WIDE:.1f}px)" in half


def test_the_legend_has_labels_and_below_large_plots_the_values(line: Line, drop: Predictor) -> None:
    session, columns = Session(drop.schema), Columns.of([Column("<b>", drop, drop.rest)]).all
    frame = session.frame(ViewRequest(session.schema.complete({}), 0.3, "balanced", columns))
    named = ("<b>", *line[1:])
    quantities = quantities_of([named], False)
    for html in (legend_html([named], large=True), values_html(frame.columns, [named], quantities, 0.3)):
        assert "&lt;b&gt;" in html
    height = np.interp(0.3, line[2].times, line[2].height)
    assert f"{height:.3f} m" in values_html(frame.columns, [named], quantities, 0.3)


@pytest.mark.parametrize("time", [0.3137, 0.4021])
def test_title_status_and_legend_say_the_same_at_any_moment(drop: Predictor, time: float) -> None:
    """Between frames too, where the plotted curves have no sample."""
    truth = truth_column(f"mass-elastic/{open_dataset('mass-elastic').select('test')[0].name}")
    assert truth.truth is not None
    session, columns = Session(drop.schema), Columns.of([Column("odeform", drop, drop.rest), truth]).all
    parameters = drop.schema.complete(truth.truth.parameters)
    frame = session.frame(ViewRequest(parameters, time, "balanced", columns))
    shown = frame.columns[0]
    lines = [(c.column.label, (0, 0, 0), session.curves(c, frame.request)) for c in frame.columns]
    legend = values_html(frame.columns, lines, quantities_of(lines, False), time)
    status = describe_column(shown, time, settled=False)
    assert shown.error is not None
    rms = f"{shown.error.rms_mm:.2f}"
    assert f"RMS {rms} mm" in title_of(shown, 1e3)
    assert f"RMS {rms}," in status
    assert f">{rms} mm" in legend
    band = shown.error_band(np.array([time]))
    assert band is not None
    assert f"90 % below {band[0, 1]:.2f} mm" in status
    assert f"90 %: {band[0, 1]:.2f} mm" in legend
    assert "50 motions that nothing was fitted to; 9 of 10 stay below it" in status


def test_a_turn_is_counted_past_half_and_whole_turns(kick: Predictor) -> None:
    session, columns = Session(kick.schema), Columns.of([Column("odeform", kick, kick.rest)]).all
    request = ViewRequest(session.schema.complete({}), 0.0, "balanced", columns)
    rotation = session.curves(session.frame(request).columns[0], request).rotation
    assert rotation[-1] > 400.0
    assert np.abs(np.diff(rotation)).max() < 10.0  # degrees per frame: no fold, no jump


def test_curves_are_sent_once_a_motion_and_the_moment_always(dropped: tuple[App, LoopbackClient]) -> None:
    app, client = dropped
    curves, cursor = app.panel(PlotPanel)._curves.content, app.panel(PlotPanel)._cursor.content
    client.set("time (s)", 0.5)
    assert client.until(lambda: app.panel(PlotPanel)._cursor.content != cursor)
    assert app.panel(PlotPanel)._curves.content == curves
    client.set("mass (kg)", 0.9)
    assert client.until(lambda: app.panel(PlotPanel)._curves.content != curves)
    client.set("odeform", False)
    assert client.until(lambda: "no column is in view" in client.text())


def test_larger_plots_are_drawn_in_two_columns(dropped: tuple[App, LoopbackClient]) -> None:
    _, client = dropped
    client.press("Larger or smaller plots")
    assert client.until(lambda: 'class="odeform-plots large"' in client.text())
    client.press("Larger or smaller plots")
    assert client.until(lambda: 'class="odeform-plots"' in client.text())


def test_after_many_moments_the_numbers_are_of_the_last(dropped: tuple[App, LoopbackClient]) -> None:
    """They are sent ten times a second, however often the moment changes."""
    app, client = dropped
    for moment in np.linspace(0.3, 0.45, 31):
        client.set("time (s)", round(float(moment), 3))
    plots = app.panel(PlotPanel)
    last = cursor_css(app.session.schema.window, 0.45)
    assert client.until(lambda: plots._cursor.content == last)
    assert client.until(lambda: app.panel(PlaybackPanel)._time.value == 0.45)


def test_a_key_while_other_columns_are_described(
    dropped: tuple[App, LoopbackClient], monkeypatch: pytest.MonkeyPatch
) -> None:
    app, client = dropped
    panel = app.panel(PlotPanel)
    panel._resize()
    draw = panel._draw
    pressed: list[Future[None]] = []

    def draw_slowly() -> None:
        if not pressed:
            pressed.extend([ThreadPoolExecutor(1).submit(panel._resize), ThreadPoolExecutor(1).submit(panel._resize)])
            wait(pressed, 0.5)
        draw()

    monkeypatch.setattr(panel, "_draw", draw_slowly)
    (first,) = app.columns.all
    app.columns.add(Column("other", first.predictor, first.geometry))
    app.page.columns_changed()
    assert client.until(lambda: bool(pressed) and all(press.done() for press in pressed))
    assert [press.exception() for press in pressed] == [None, None]
