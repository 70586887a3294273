"""How finely to integrate, as its users choose it."""

import json

import pytest

from odeform.models.base import Predictor
from odeform.models.frontier import cheapest_within_error
from odeform.models.registry import load
from odeform.solver.registry import TITLES
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column
from odeform_viz.panels.quality import ERROR_BUDGET, TIME_BUDGET, QualityPanel, quality_names
from odeform_viz.session import settings_of


def chosen(app: App) -> dict[str, object]:
    quality = app.request().quality
    return json.loads(quality) if quality.startswith("{") else {}


def test_an_error_chooses_the_cheapest_setting_that_keeps_to_it(
    kicked: tuple[App, LoopbackClient], kick: Predictor
) -> None:
    app, client = kicked
    assert not client.controls["at most (mm)"].visible
    client.set("quality", ERROR_BUDGET)
    useful = [point for point in kick.frontier if point.solver_error_mm < 50.0]
    for point in (useful[0], useful[len(useful) // 2], useful[-1]):
        client.set("at most (mm)", 1.001 * point.solver_error_mm)
        assert client.until(lambda point=point: chosen(app) == point.quality.to_json())
    assert client.until(lambda: TITLES[kick.frontier[-1].quality.method] in client.text())
    assert client.until(lambda: client.controls["at most (mm)"].visible)
    assert client.until(lambda: not client.controls["at most (ms)"].visible)


def test_a_longer_time_never_chooses_a_coarser_setting(kicked: tuple[App, LoopbackClient], kick: Predictor) -> None:
    app, client = kicked
    panel = app.panel(QualityPanel)
    client.set("quality", TIME_BUDGET)
    settings = [point.quality.to_json() for point in kick.frontier]
    places = []
    for budget in (0.1, 2.0, 8.0, 30.0, 1000.0):
        client.set("at most (ms)", budget)
        assert client.until(lambda budget=budget: panel._budget_ms.value == budget and chosen(app) != {})
        places.append(settings.index(chosen(app)))
    assert places == sorted(places)
    assert (places[0], places[-1]) == (0, len(settings) - 1)
    assert client.until(lambda: "ms on this machine, as measured" in client.text())


def test_a_state_restores_the_setting(kicked: tuple[App, LoopbackClient], kick: Predictor) -> None:
    app, client = kicked
    assert app.panel(QualityPanel) is not None
    setting = json.dumps(kick.frontier[1].quality.to_json())
    app.panel(QualityPanel).set(setting)
    assert app.request().quality == setting
    app.panel(QualityPanel).set("draft")
    assert app.request().quality == "draft"
    client.set("at most (mm)", -1.0)
    client.set("quality", ERROR_BUDGET)
    assert client.until(lambda: "expected a budget from 1e-06 to 100, got -1" in client.text())


def test_a_budget_is_that_of_the_object_at_hand(serve) -> None:
    model = load("contact-force")
    app, client = serve(Column("odeform", model, model.rest, origin="contact-force"))
    client.set("quality", ERROR_BUDGET)
    client.set("at most (mm)", 0.3)
    settings = []
    for name in ("bottle", "dog"):
        frontier = model.frontier_of({"object": name})
        settings.append(cheapest_within_error(frontier, 0.3).quality.to_json())
        client.set("object", name)
        assert client.until(lambda: chosen(app) == settings[-1])
    assert settings[0] != settings[1]


def test_what_a_model_lacks_is_not_there(serve, kick: Predictor) -> None:
    assert quality_names(kick)[-2:] == (TIME_BUDGET, ERROR_BUDGET)
    app, client = serve(Column("pod-rbf", load("kick/pod-rbf"), kick.rest))
    assert not any(isinstance(panel, QualityPanel) for panel in app.page.panels)
    assert "quality" not in client.controls


def test_settings_without_sense_are_refused(kick: Predictor) -> None:
    for requested in ("{", '{"method": "rk5", "step": 1}', '{"step": 0.1}', '{"method": "rk4", "step": "x"}'):
        with pytest.raises(ValueError, match=r"quality|solver"):
            settings_of(kick, requested)
    assert settings_of(kick, "unknown") == "balanced"
