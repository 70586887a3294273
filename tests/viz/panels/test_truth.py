"""The truth beside the models: opened, left, simulated on the spot."""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from clamped_bodies import clamped_bar, recording

from odeform.dataset.store import open_dataset
from odeform.models.base import Predictor
from odeform.models.registry import load, load_model
from odeform.simulation.scenes import kick as kick_scene
from odeform.types import MotionSequence
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column
from odeform_viz.panels import truth
from odeform_viz.panels.parameters import ParameterPanel
from odeform_viz.panels.truth import NONE, SIMULATED, TruthPanel, entry_label, physics_difference
from odeform_viz.runtime import notices
from odeform_viz.runtime.jobs import Report

View = tuple[App, LoopbackClient]
ENTRIES = open_dataset("mass-elastic").select("test")


def coarse(report: Report, scene: str, parameters: dict[str, float], rate: float) -> MotionSequence:
    """A kick of a quarter of the vertices; in this module, for the job's process to find it."""
    assert scene == "kick"
    return replace(kick_scene.SCENE, step=2e-3).simulate(parameters, rate=rate, report=report, resolution=4)


def at_rest(report: Report, scene: str, parameters: dict[str, float], rate: float) -> MotionSequence:
    rest = load(scene).rest
    frames = np.tile(rest.points, (3, 1, 1))
    weights = np.full(len(rest.points), 1.0 / len(rest.points), dtype=np.float32)
    return MotionSequence(np.arange(3) / rate, frames, rest.faces, weights, parameters)


def endless(report: Report, scene: str, parameters: dict[str, float], rate: float) -> None:
    for step in range(10_000):
        report(step / 10_000)
        time.sleep(0.01)


def failing(report: Report, scene: str, parameters: dict[str, float], rate: float) -> None:
    raise RuntimeError("the ball burst")


def test_a_test_sequence_moves_the_sliders_and_stands_beside_the_model(dropped: View) -> None:
    app, client = dropped
    for entry in ENTRIES[:2]:
        client.set("test sequence", entry_label(entry, app.session.schema))
        expected = pytest.approx(entry.parameters)
        assert client.until(lambda expected=expected: app.panel(ParameterPanel).parameters() == expected)
    assert [c.label for c in app.columns.all] == ["odeform", "truth"]
    assert client.until(lambda: "error now:" in client.text() and "distance from the truth" in client.text())
    assert client.until(lambda: "error (dashed: expected), mm" in client.text())


def test_away_from_its_parameters_nothing_is_compared_and_there_is_a_way_back(dropped: View) -> None:
    app, client = dropped
    back = "Set sliders to the truth"
    client.set("test sequence", entry_label(ENTRIES[0], app.session.schema))
    assert client.until(lambda: "error now:" in client.text())
    assert client.until(lambda: not client.controls[back].visible)
    client.set("mass (kg)", 0.9)
    assert client.until(lambda: "The truth was simulated with other parameters" in client.text())
    assert client.until(lambda: "error now:" not in client.text())
    assert client.until(lambda: client.controls[back].visible)
    client.click(back)
    assert client.until(lambda: "error now:" in client.text())
    assert client.until(lambda: "The truth was simulated with other parameters" not in client.text())


def test_the_truth_goes_and_what_is_not_in_the_list_is_refused(dropped: View) -> None:
    app, client = dropped
    client.set("test sequence", entry_label(ENTRIES[0], app.session.schema))
    assert client.until(lambda: len(app.columns.all) == 2)
    client.set("test sequence", "nonsense")
    assert client.until(lambda: any("test sequence: expected one of the list" in said for said in client.notifications))
    assert len(app.columns.all) == 2
    assert client.until(lambda: client.controls["test sequence"].value.startswith("1:"))
    client.set("test sequence", NONE)
    assert client.until(lambda: len(app.columns.all) == 1)


def test_the_list_names_the_truth_that_was_opened_otherwise(serve: Callable[..., View], drop: Predictor) -> None:
    schema, sequence = drop.schema, open_dataset("mass-elastic").read(ENTRIES[0])
    app, client = serve(Column("odeform", drop, drop.rest), moment=0.3)
    app.panel(TruthPanel).open(sequence, f"mass-elastic/{ENTRIES[0].name}")
    assert client.until(lambda: client.controls["test sequence"].value == entry_label(ENTRIES[0], schema))
    app.panel(TruthPanel).open(replace(sequence, name=""))
    assert client.until(lambda: client.controls["test sequence"].value == SIMULATED)


def test_simulate_this_shows_its_progress_and_then_the_truth(kicked: View, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(truth, "simulate_motion", coarse)
    app, client = kicked
    client.set("mass (kg)", 0.6)
    assert client.until(lambda: app.panel(ParameterPanel).parameters()["mass"] == 0.6)
    client.click("Simulate this")
    assert client.until(lambda: client.controls["Cancel"].visible and not client.controls["Simulate this"].visible)
    shares, end = [0.0], time.monotonic() + 60.0
    while len(app.columns.all) == 1 and time.monotonic() < end:
        client.receive(0.1)
        shares.append(app.panel(TruthPanel)._bar.value)
    assert max(shares) > 10.0
    record = app.columns.all[1].truth
    assert record is not None
    assert record.parameters["mass"] == 0.6
    assert record.rate == pytest.approx(4 * 120.0)
    assert client.until(lambda: not client.controls["Cancel"].visible and client.controls["Simulate this"].visible)
    assert client.until(lambda: "error now:" in client.text())


def test_a_simulation_can_be_cancelled(kicked: View, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(truth, "simulate_motion", endless)
    app, client = kicked
    client.click("Simulate this")
    assert client.until(lambda: app.panel(TruthPanel)._bar.value > 0.0)
    job = app.panel(TruthPanel)._job
    assert job is not None
    app.panel(TruthPanel)._simulate()  # as from another tab: one at a time
    assert app.panel(TruthPanel)._job is job
    client.click("Cancel")
    assert client.until(lambda: not job.running and client.controls["Simulate this"].visible)
    assert len(app.columns.all) == 1


def test_a_failing_simulation_says_why_until_the_next(kicked: View, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(truth, "simulate_motion", failing)
    app, client = kicked
    client.click("Simulate this")
    assert client.until(lambda: "**The simulation failed**: the ball burst" in client.text())
    monkeypatch.setattr(truth, "simulate_motion", endless)
    client.click("Simulate this")
    assert client.until(lambda: "the ball burst" not in client.text())
    app.panel(TruthPanel).close()


def test_the_simulation_of_a_closed_tab_completes(kicked: View, monkeypatch: pytest.MonkeyPatch, port: int) -> None:
    monkeypatch.setattr(truth, "simulate_motion", at_rest)
    app, client = kicked
    with LoopbackClient(port) as other:
        other.click("Simulate this")
        assert client.until(lambda: client.controls["Cancel"].visible)
    assert client.until(lambda: len(app.columns.all) == 2)
    assert client.until(lambda: not client.controls["Cancel"].visible)


def test_a_server_that_closes_ends_its_simulation(kick: Predictor, monkeypatch: pytest.MonkeyPatch, port: int) -> None:
    monkeypatch.setattr(truth, "simulate_motion", endless)
    app = App([Column("odeform", kick, kick.rest)], port=port)
    with LoopbackClient(port) as client:
        client.click("Simulate this")
        assert client.until(lambda: app.panel(TruthPanel)._job is not None)
    app.close()
    assert app.panel(TruthPanel)._job is not None
    assert not app.panel(TruthPanel)._job.running


def test_other_physics_are_remarked_and_the_same_are_not(kick: Predictor, serve: Callable[..., View]) -> None:
    made = kick.checkpoint.provenance
    other = replace(kick.checkpoint, provenance={**made, "fixed": {**made["fixed"], "young_pa": 1.7e5}})
    _, client = serve(Column("odeform", load_model(other), kick.rest))
    assert client.until(lambda: "Young's modulus 130 kPa (trained with Young's modulus 170 kPa)" in client.text())
    trained_with = load("mass-elastic").checkpoint.provenance["fixed"]
    assert physics_difference(trained_with, open_dataset("mass-elastic").fixed) == ""
    assert physics_difference({"b": 1.0}, {"b": 2.0}) == "b 2 (trained with b 1)"
    assert physics_difference({}, {"b": 2.0}) == "b 2 (not known of the training)"


def test_constants_of_the_training_that_do_not_act_here_are_not_remarked() -> None:
    sphere = {"gravity_m_s2": 9.81, "projectile_mass_kg": 0.02}
    assert physics_difference(sphere, {"gravity_m_s2": 9.81}) == ""


def test_errors_are_painted_and_follow_the_key(dropped: View) -> None:
    app, client = dropped
    client.set("test sequence", entry_label(ENTRIES[0], app.session.schema))
    assert client.until(lambda: any("/body/colored" in node for node in client.nodes))
    assert client.until(lambda: app.presenter.frame is not None and app.presenter.frame.columns[0].error is not None)
    assert app.presenter.frame is not None
    error, scale = app.presenter.frame.columns[0].error, app.presenter.scale
    assert error is not None
    assert scale is not None
    assert 1e3 * np.median(error.distances) < scale.top
    assert client.until(lambda: "distance from the truth, mm" in client.text())
    client.press("Next colours")
    assert client.until(lambda: "distance from the truth, mm" not in client.text())
    part = app.server.scene.get_handle_by_name(f"/world/column_{app.columns.all[0].key}/body/part_0")
    assert part is not None
    assert part.visible


def test_a_recording_of_markers_stands_beside_the_clamped_body(
    serve: Callable[..., View], monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr(notices.Notices, "show", lambda _, title, message: said.append(message))
    model = clamped_bar()
    app, client = serve(Column("beam", model, model.rest))
    assert client.until(lambda: "nothing learned" in client.text())
    client.upload("Open a motion...", "bar.npz", recording(model, model.schema.complete(None)))
    assert client.until(lambda: app.columns.truth is not None)
    assert client.until(lambda: "error now:" in client.text())
    client.set("stiffness (kPa)", 300.0)
    assert client.until(lambda: app.panel(ParameterPanel).parameters()["young"] == 300.0)
    client.upload("Open a motion...", "other.npz", b"PK nothing")
    assert client.until(lambda: any("expected a .c3d, or an .npz" in message for message in said))
