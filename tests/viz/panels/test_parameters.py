"""Sliders: presets, reset, and values outside the trained range."""

import threading

import numpy as np
import pytest
from stubs import SCHEMA

from odeform.models.base import Predictor
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.panels.parameters import NO_PRESET, ParameterPanel, presets, samples_svg, slider_range, slider_step
from odeform_viz.runtime import notices

View = tuple[App, LoopbackClient]
PRESET = "high mass, low spring"


def test_a_preset_moves_the_sliders_and_can_be_chosen_again(stubbed: View) -> None:
    app, client = stubbed
    mass = client.controls["mass (kg)"]
    for _ in range(2):
        client.set("preset", PRESET)
        assert client.until(lambda: app.panel(ParameterPanel).parameters() == presets(SCHEMA)[PRESET])
        assert client.until(lambda: mass.value == 1.0)
        client.set("mass (kg)", 0.7)
        assert client.until(lambda: client.controls["preset"].value == NO_PRESET)


def test_the_preset_follows_sliders_that_no_frame_follows(stubbed: View, monkeypatch: pytest.MonkeyPatch) -> None:
    app, client = stubbed
    panel = app.panel(ParameterPanel)
    client.set("preset", PRESET)
    assert client.until(lambda: (f := app.presenter.frame) is not None and f.request.parameters["mass"] == 1.0)
    assert client.until(lambda: client.controls["mass (kg)"].value == 1.0 and app.presenter.settled)
    monkeypatch.setattr(panel, "_wake", lambda: None)
    client.set("mass (kg)", 0.7)
    assert client.until(lambda: client.controls["preset"].value == NO_PRESET)


def test_a_preset_chosen_while_frames_are_described_is_not_lost(stubbed: View) -> None:
    """The worker reads the sliders, a choice arrives, the worker shows what it has read."""
    app, client = stubbed
    panel, wanted = app.panel(ParameterPanel), presets(SCHEMA)[PRESET]
    done, threads = threading.Event(), []

    def describe() -> None:
        while not done.is_set():
            panel._refresh()

    for _ in range(3):
        threads.append(threading.Thread(target=describe))
        threads[-1].start()
    try:
        for mass in np.linspace(0.5, 0.9, 20):
            client.set("mass (kg)", float(mass))
            client.set("preset", NO_PRESET)
            client.set("preset", PRESET)
            assert client.until(lambda: panel.parameters() == wanted)
    finally:
        done.set()
        for thread in threads:
            thread.join()


def test_no_preset_cannot_be_chosen(stubbed: View) -> None:
    _, client = stubbed
    client.set("preset", NO_PRESET)
    assert client.until(lambda: client.controls["preset"].value == "defaults")


def test_reset_of_all(stubbed: View) -> None:
    app, client = stubbed
    default = {p.name: p.default for p in SCHEMA.parameters}
    client.set("mass (kg)", 0.9)
    client.set("spring (N/m)", 4.0)
    client.set("reset", "all")
    assert client.until(lambda: app.panel(ParameterPanel).parameters() == default)
    assert client.until(lambda: client.controls["preset"].value == "defaults")


@pytest.mark.parametrize("value", [float("inf"), float("-inf"), 1e9, -1.0])
def test_values_that_no_slider_has_are_refused_until_reset(
    stubbed: View, value: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(notices, "REPEAT", 0.0)
    app, client = stubbed
    client.set("mass (kg)", value)
    assert client.until(lambda: "mass: expected a finite number from" in client.text())
    for button in ("Pin these parameters", "Sweep it", "Save state"):
        client.click(button)
        assert client.until(lambda: bool(client.notifications))
        client.notifications.clear()
    assert len(app.columns.all) == 1
    client.set("reset", "all")
    assert client.until(lambda: "expected a finite number" not in client.text())


def test_outside_the_trained_range_a_slider_says_so(stubbed: View) -> None:
    _, client = stubbed
    client.set("spring (N/m)", 5.5)
    assert client.until(lambda: "outside the trained range, 1 to 5 N/m" in client.text())
    client.set("spring (N/m)", 4.0)
    assert client.until(lambda: "outside the trained range, 1" not in client.text())


def test_training_samples_are_marked_where_they_lie() -> None:
    mass = SCHEMA.parameters[0]
    low, high = slider_range(mass)
    svg = samples_svg(mass, np.array([low, 0.5 * (low + high), high]), mass.default)
    assert all(f'<rect x="{percent}%" width="1"' in svg for percent in ("0.00", "50.00", "100.00"))
    assert samples_svg(mass, None, mass.default).count("<rect") == 1


def test_a_slider_has_no_needless_digits(kick: Predictor) -> None:
    assert [slider_step(*slider_range(p)) for p in kick.schema.parameters[:3]] == pytest.approx([0.001, 0.01, 0.1])
