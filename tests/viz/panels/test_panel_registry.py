"""A panel is one class and one line of the registry."""

import json

import pytest
from stubs import StubPredictor
from toy_panel import ToyPanel, UnneededPanel

import odeform
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column
from odeform_viz.panels.help import HelpPanel
from odeform_viz.panels.registry import PANELS, Entry

TOY = Entry("side/Toys", "toy_panel:ToyPanel")


def _shown(stub: StubPredictor) -> Column:
    return Column("stub", stub, stub.rest, origin="kick")


def test_a_panel_of_one_class_and_one_line_takes_part_in_everything(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    stub = StubPredictor()
    monkeypatch.setattr(odeform, "load", lambda name: stub)  # what a saved state refers to
    app = App([_shown(stub)], port=port, panels=(TOY, *PANELS))
    try:
        toy = app.panel(ToyPanel)
        with LoopbackClient(port) as client:
            client.set("time (s)", 0.5)
            assert client.until(lambda: "toy: 0.350 m" in client.text())
            client.press("Say hello")
            assert client.until(lambda: "hotkey" in toy.calls)
            assert "**T** say hello" in client.text()
            client.set("mass (kg)", float("nan"))
            assert client.until(lambda: any("mass: expected a finite number" in call for call in toy.calls))
            client.set("reset", "all")
            assert client.until(lambda: app.presenter.settled)
            state = json.loads(app.page.save())
            app.page.restore(json.dumps({**state, "time": 0.25}).encode())
            assert "restore 0.25" in toy.calls
    finally:
        app.close()
    assert toy.calls[-1] == "close"


def test_a_panel_that_is_not_needed_is_not_built(port: int) -> None:
    app = App([_shown(StubPredictor())], port=port, panels=(Entry("side/Toys", "toy_panel:UnneededPanel"), *PANELS))
    try:
        assert not any(isinstance(panel, UnneededPanel) for panel in app.page.panels)
        with LoopbackClient(port) as client:
            assert "Toys" not in client.text()
        assert isinstance(app.page.panels[-1], HelpPanel)
    finally:
        app.close()


def test_places_of_the_registry_are_known() -> None:
    assert len({entry.panel for entry in PANELS}) == len(PANELS)
    assert all(entry.place.split("/")[0] in ("side", "bottom") for entry in PANELS)
