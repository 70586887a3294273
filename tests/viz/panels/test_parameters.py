"""Sliders: presets, reset, and what lies beyond the training."""

import numpy as np
import pytest

from odeform.models.base import Predictor
from odeform_viz.app import App
from odeform_viz.benchmark.client import LoopbackClient
from odeform_viz.panels.parameters import NO_PRESET, ParameterPanel, presets, samples_svg, slider_range, slider_step
from odeform_viz.runtime import notices

Kicked = tuple[App, LoopbackClient]


def test_a_preset_moves_the_sliders_and_can_be_chosen_again(kicked: Kicked, kick: Predictor) -> None:
    app, client = kicked
    mass = client.controls["mass (kg)"]
    name = "high mass, low bending"
    for _ in range(2):
        client.set("preset", name)
        assert client.until(lambda: app.panel(ParameterPanel).parameters() == presets(kick.schema)[name])
        assert client.until(lambda: mass.value == 1.0)
        client.set("mass (kg)", 0.7)
        assert client.until(lambda: client.controls["preset"].value == NO_PRESET)


def test_reset_of_one_and_of_all(kicked: Kicked, kick: Predictor) -> None:
    app, client = kicked
    default = {p.name: p.default for p in kick.schema.parameters}
    client.set("mass (kg)", 0.9)
    client.set("force (N)", 110.0)
    client.set("reset", "mass")
    assert client.until(lambda: app.panel(ParameterPanel).parameters() == {**default, "force": 110.0})
    client.set("reset", "nonsense")
    client.set("reset", "all")
    assert client.until(lambda: app.panel(ParameterPanel).parameters() == default)
    assert client.until(lambda: client.controls["preset"].value == "defaults")


@pytest.mark.parametrize("value", [float("inf"), float("-inf"), 1e9, -1.0])
def test_what_no_hand_could_reach_is_refused_and_reset_helps(
    kicked: Kicked, value: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(notices, "REPEAT", 0.0)
    app, client = kicked
    client.set("mass (kg)", value)
    assert client.until(lambda: "mass: expected a finite number from" in client.text())
    for button in ("Pin these parameters", "Sweep it in 5 columns", "Save state"):
        client.click(button)
        assert client.until(lambda: bool(client.notifications))
        client.notifications.clear()
    assert len(app.columns.all) == 1
    client.set("reset", "mass")
    assert client.until(lambda: "expected a finite number" not in client.text())


def test_beyond_the_trained_range_a_slider_says_so(kicked: Kicked) -> None:
    _, client = kicked
    client.set("bending (N m)", 2.2)
    assert client.until(lambda: "outside the trained range, 0.3 to 2 N m" in client.text())
    client.set("bending (N m)", 1.9)
    assert client.until(lambda: "outside the trained range, 0.3" not in client.text())


def test_training_samples_are_marked_where_they_lie(kick: Predictor) -> None:
    mass = kick.schema.parameters[0]
    low, high = slider_range(mass)
    svg = samples_svg(mass, np.array([low, 0.5 * (low + high), high]), mass.default)
    assert all(f'<rect x="{place}%" width="1"' in svg for place in ("0.00", "50.00", "100.00"))
    assert samples_svg(mass, None, mass.default).count("<rect") == 1


def test_a_slider_reads_without_spare_digits(kick: Predictor) -> None:
    assert [slider_step(*slider_range(p)) for p in kick.schema.parameters[:3]] == pytest.approx([0.001, 0.01, 0.1])
