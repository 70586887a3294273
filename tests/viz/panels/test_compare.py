"""Columns added, pinned, swept, hidden, removed; how they are arranged."""

from collections.abc import Callable

import numpy as np
import pytest

from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.colors import MODELS, color_of
from odeform_viz.columns import MOST, Column
from odeform_viz.view import Frame

Kicked = tuple[App, LoopbackClient]
Serve = Callable[..., Kicked]


def _frame(app: App) -> Frame:
    frame = app.presenter.frame
    assert frame is not None
    return frame


def _labels(app: App) -> list[str]:
    return [c.label for c in app.columns.all]


def test_a_model_is_added_as_a_column_of_its_own(kicked: Kicked) -> None:
    app, client = kicked
    client.set("model", "POD + RBF")
    client.click("Add model")
    assert client.until(lambda: "/world/column_1/body/part_0" in client.nodes)
    assert _labels(app) == ["odeform", "POD + RBF"]
    assert client.until(lambda: client.controls["POD + RBF"].value is True)
    client.set("model", "nonsense")
    client.click("Add model")
    assert client.until(lambda: any("model: expected one of" in said for said in client.notifications))
    assert _labels(app) == ["odeform", "POD + RBF"]


@pytest.mark.slow
def test_a_pushed_object_is_compared_with_the_bundled_rivals(serve: Serve) -> None:
    """They know neither another mass nor another stiffness, and predict the object's own."""
    predictor, rivals = load("contact-force"), ("gp", "nearest", "pod-rbf")
    app, client = serve(Column("odeform", predictor, predictor.rest, origin="contact-force/odeform"), moment=0.1)
    for count, label in enumerate(("kernel regression", "nearest training motion", "POD + RBF"), 2):
        client.set("model", label)
        client.click("Add model")
        assert client.until(lambda count=count: app.presenter.settled and len(_frame(app).columns) == count)
    shown = _frame(app)
    known = {k: v for k, v in shown.request.parameters.items() if k not in ("mass", "young")}
    for column, model in zip(shown.columns[1:], rivals, strict=True):
        rival = load(f"contact-force/{model}")
        np.testing.assert_array_equal(column.points, rival.solve(rival.rest, known).deformed(0.1))
        assert 0.0 < np.abs(column.points - shown.columns[0].points).max() < 0.05


def test_a_pinned_column_stays_while_the_sliders_go_on(kicked: Kicked, kick: Predictor) -> None:
    app, client = kicked
    client.set("mass (kg)", 0.6)
    client.click("Pin these parameters")
    assert client.until(lambda: len(app.columns.all) == 2)
    assert _labels(app)[1].startswith("odeform at mass 0.6 kg, bending")
    assert client.until(lambda: app.presenter.settled and len(_frame(app).columns) == 2)
    client.set("mass (kg)", 0.9)
    moved = client.wait_vertices("/world/column_0/body/part_0")
    assert moved is not None
    # what did not move is not sent again, or sent as it was
    still = kick.solve(kick.rest, {"mass": 0.6}).deformed(0.03)
    assert client.until(lambda: _frame(app).request.parameters["mass"] == 0.9)
    np.testing.assert_array_equal(_frame(app).columns[1].points, still)


def test_a_sweep_stands_alone_and_goes_again(kicked: Kicked) -> None:
    app, client = kicked
    client.set("parameter", "bending")
    client.click("Sweep it")
    assert client.until(lambda: f"/world/column_{5}/body/part_0" in client.nodes)
    assert [c.visible for c in app.columns.all] == [False] + 5 * [True]
    assert _labels(app)[1] == "bending 0.3 N m"
    for label in _labels(app)[1:]:
        client.set(label, False)
    client.set("odeform", True)
    assert client.until(lambda: [c.visible for c in app.columns.all] == [True] + 5 * [False])
    client.click("Remove hidden columns")
    assert client.until(lambda: _labels(app) == ["odeform"])
    assert client.until(lambda: not any(n.startswith("/world/column_5") for n in client.nodes))
    assert client.until(lambda: "bending 0.3 N m" not in client.controls)
    client.set("parameter", "nonsense")
    client.click("Sweep it")
    assert client.until(lambda: any("parameter: expected" in said for said in client.notifications))
    assert [c.visible for c in app.columns.all] == [True]


def test_only_what_is_shown_is_computed(serve: Serve, kick: Predictor) -> None:
    rival, asked = load("kick/pod-rbf"), []
    solve = rival.solve
    rival.solve = lambda *given, **named: (asked.append(1), solve(*given, **named))[1]  # pyright: ignore
    app, client = serve(Column("odeform", kick, kick.rest), Column("rival", rival, rival.rest))
    client.set("rival", False)
    assert client.until(lambda: not app.columns.all[1].visible)
    assert client.until(lambda: app.presenter.settled and len(_frame(app).columns) == 1)
    asked.clear()
    client.set("mass (kg)", 0.9)
    assert client.until(lambda: app.presenter.settled and _frame(app).request.parameters["mass"] == 0.9)
    assert asked == []
    client.set("rival", True)
    assert client.until(lambda: bool(asked))


def test_overlaid_columns_stand_in_one_place_by_box_and_by_key(serve: Serve, kick: Predictor) -> None:
    app, client = serve(Column("one", kick, kick.rest), Column("two", kick, kick.rest))
    one, two = (view for _, view in app.scene._views.values())
    assert np.any(one.offset != two.offset)
    client.set("overlay", True)
    assert client.until(lambda: bool(np.all(one.offset == two.offset)))
    client.press("Overlay on or off")
    assert client.until(lambda: bool(np.any(one.offset != two.offset)))
    assert client.until(lambda: client.controls["overlay"].value is False)


def test_too_many_columns_are_refused(kicked: Kicked) -> None:
    app, client = kicked
    for count in (6, 11):
        client.click("Sweep it")
        assert client.until(lambda count=count: len(app.columns.all) == count)
    client.click("Sweep it")
    assert client.until(lambda: any(f"at most {MOST}" in said for said in client.notifications))
    assert len(app.columns.all) == 11
    assert any(c.visible for c in app.columns.all)


def test_a_column_keeps_its_colour_and_shares_it_with_no_other(kicked: Kicked) -> None:
    app, client = kicked
    for count in (2, 3):
        client.click("Pin these parameters")
        assert client.until(lambda count=count: len(app.columns.all) == count)
    _, second, third = app.columns.all
    assert client.until(lambda: {second.label, third.label} <= set(client.controls))
    client.set(second.label, False)
    assert client.until(lambda: not app.columns.all[1].visible)
    client.click("Remove hidden columns")
    assert client.until(lambda: len(app.columns.all) == 2)
    assert color_of(app.columns.all[1]) == color_of(third) == MODELS[2]
    client.click("Pin these parameters")
    assert client.until(lambda: len(app.columns.all) == 3)
    assert {color_of(c) for c in app.columns.all} == set(MODELS[:3])
