"""Fitting the visible truth on the page."""

import io
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.geometry.shape import surface_weights
from odeform.identification.identify import Identification, Identified
from odeform.identification.pushed.evidence import Known
from odeform.identification.pushed.recorded import Recorded, together_points
from odeform.loads.registry import get_load
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import MOST, Column
from odeform_viz.panels import fit
from odeform_viz.panels.fit import FitPanel
from odeform_viz.panels.fit_search import CORRECTIONS, MADE, STOPPED, describe_identification
from odeform_viz.panels.parameters import ParameterPanel
from odeform_viz.panels.truth import NONE, TruthPanel, entry_label
from odeform_viz.runtime.jobs import Report

View = tuple[App, LoopbackClient]
ENTRY = open_dataset("mass-elastic").select("test")[2]


def endless(report: Report, model: type, *_: object) -> None:
    """Steps that never converge; in this module, for the job's process to find it."""
    while True:
        report(({"mass": 0.6, "bending": 0.5}, 3.0))
        time.sleep(0.01)


def failing(*_: object) -> None:
    raise InputError("nothing fits")


START, CANCEL, USE = "Fit to the truth", "Cancel the fit", "Set sliders to the estimate"


def _open(app: App, client: LoopbackClient) -> None:
    client.set("test sequence", entry_label(ENTRY, app.session.schema))
    assert client.until(lambda: not client.controls[START].props["disabled"])


def test_estimates_stand_beside_the_truth_and_go_to_the_sliders(dropped: View) -> None:
    app, client = dropped
    assert client.controls[START].props["disabled"]
    _open(app, client)
    client.set("mass (kg)", 0.9)
    client.click(START)
    assert client.until(lambda: "model and noise explain the motion" in client.text())
    assert [c.label for c in app.columns.all] == ["odeform", "truth", "fit"]
    found = app.columns.all[2].pinned
    assert found is not None
    for name, true in ENTRY.parameters.items():
        assert found[name] == pytest.approx(true, rel=0.02)
        assert f"| {name} (" in client.text()
    client.click(USE)
    assert client.until(lambda: app.panel(ParameterPanel).parameters() == pytest.approx(dict(found)))


def test_a_second_fit_takes_the_column_of_the_first(dropped: View) -> None:
    app, client = dropped
    _open(app, client)
    keys, panel = [], app.panel(FitPanel)
    for _ in range(2):
        before = panel._job
        client.click(START)
        assert client.until(lambda before=before: panel._job is not before)
        assert client.until(lambda: panel._job is not None and not panel._job.running)
        assert client.until(lambda: client.controls[START].visible)
        keys.append([c.key for c in app.columns.all])
    assert keys[0] == keys[1]


@pytest.mark.parametrize("how", ["cancel", "truth", "close"])
def test_a_search_ends_when_it_is_not_needed(dropped: View, monkeypatch: pytest.MonkeyPatch, how: str) -> None:
    """Cancelled, without the truth that it fits, or with the page."""
    app, client = dropped
    _open(app, client)
    monkeypatch.setattr(fit, "fit_parameters", endless)
    client.click(START)
    assert client.until(lambda: "of what is expected: 3" in client.text())
    panel = app.panel(FitPanel)
    assert panel._job is not None
    if how == "cancel":
        client.click(CANCEL)
    elif how == "truth":
        client.set("test sequence", NONE)
    else:
        panel.close()
    assert client.until(lambda: client.controls[START].visible and not client.controls[CANCEL].visible)
    assert not panel._job.running
    panel._job._process.join(60.0)
    assert not panel._job._process.is_alive()
    assert client.until(lambda: "of what is expected" not in client.text())
    assert client.until(lambda: not client.controls[USE].visible)


def test_a_search_without_room_for_a_column_goes_on_and_says_so(dropped: View) -> None:
    app, client = dropped
    _open(app, client)
    model = app.columns.all[0]
    while len(app.columns.all) < MOST:
        app.columns.add(replace(model, label="pinned", pinned=dict(ENTRY.parameters), visible=False))
    client.click(START)
    assert client.until(lambda: "The motion found is not shown" in client.text())
    assert client.until(lambda: "model and noise explain the motion" in client.text())
    assert len(app.columns.all) == MOST


def test_a_search_that_fails_says_why(dropped: View, monkeypatch: pytest.MonkeyPatch) -> None:
    app, client = dropped
    _open(app, client)
    monkeypatch.setattr(fit, "fit_parameters", failing)
    client.click(START)
    assert client.until(lambda: "**The fit failed**: nothing fits" in client.text())
    assert client.until(lambda: client.controls[START].visible)


def test_what_is_not_determined_is_not_given_as_a_number() -> None:
    sure, vague = Identified(0.7, 0.69, 0.71, True, 0.1, 0.01), Identified(0.3, 0.1, 0.9, False, 0.0, 1.3)
    large = Identified(1571.0, 1080.0, 22700.0, True, 0.1, 0.3)
    found = Identification({"mass": sure, "bending": vague, "friction": sure, "young": large}, 3.0, 1.0)
    text = describe_identification(found, get_scene("kick").schema, {"mass": 0.72})
    assert "| mass (kg) | **0.7** | 0.69 to 0.71 | 0.72 |" in text
    assert "| bending (N m) | not identifiable | 0.1 to 0.9 |  |" in text
    assert "| friction | **0.7** | 0.69 to 0.71 |  |" in text
    assert "| young | **1570** | 1080 to 22700 |  |" in text
    assert "| azimuth (rad) | *as given* | |  |" in text
    assert "the model does not explain this motion" in text


def test_models_that_cannot_be_fitted_have_no_panel(serve) -> None:
    predictor = load("contact-force/gp")
    app, client = serve(Column("odeform", predictor, predictor.rest))
    assert START not in client.controls
    assert not any(isinstance(panel, FitPanel) for panel in app.page.panels)


def test_a_motion_of_ones_own_is_opened_and_fitted(dropped: View) -> None:
    app, client = dropped
    sequence = open_dataset("mass-elastic").read(ENTRY)
    file = io.BytesIO()
    seen = slice(300)  # it ends while the ball moves
    np.savez(file, times=sequence.times[seen], vertices=sequence.vertices[seen], faces=sequence.faces)
    client.upload("Open a motion...", "captured.npz", file.getvalue())
    assert client.until(lambda: not client.controls[START].props["disabled"])
    assert client.until(lambda: client.controls["test sequence"].value == "captured.npz")
    assert client.until(lambda: "Not known of the truth: mass, bending" in client.text())
    client.click(START)
    assert client.until(lambda: "model and noise explain the motion" in client.text())
    assert client.until(lambda: "this one ends at 0.6" in client.text())
    found = app.columns.all[2].pinned
    assert found is not None
    for name, true in ENTRY.parameters.items():
        assert found[name] == pytest.approx(true, rel=0.05)


def test_a_motion_that_cannot_be_read_is_refused(dropped: View) -> None:
    app, client = dropped
    client.upload("Open a motion...", "captured.npz", b"nothing")
    assert client.until(lambda: any("captured.npz: damaged" in note for note in client.notifications))
    assert [c.label for c in app.columns.all] == ["odeform"]


def test_a_slider_out_of_range_is_said(dropped: View) -> None:
    app, client = dropped
    _open(app, client)
    client.set("mass (kg)", 1e9)
    client.click(START)
    assert client.until(lambda: "The fit failed" in client.text() and "got 1e+09" in client.text())


def telling(report: Report, predictor: Predictor, seen: Known, known: dict[str, Any], simulations: int) -> None:
    """What a fit of a push says on its way."""
    numbers = {name: value for name, value in predictor.complete(known).items() if not isinstance(value, str)}
    report(({**numbers, "friction": 0.5}, 3.0))
    report(f"{simulations} simulations of {len(seen.times)} frames, {'contact_x' in known}")
    time.sleep(60.0)


def telling_of_the_body(
    report: Report, predictor: Predictor, experiments: list[Recorded], known: dict[str, Any], simulations: int
) -> None:
    """The same of a fit of experiments that are known."""
    (one,) = experiments
    telling(report, predictor, together_points([one]), dict(one.made.experiment.parameters), simulations)


@pytest.fixture
def pushed_page() -> Iterator[View]:
    """A page with a push as truth, which a fit is to correct by simulations."""
    model = load("contact-force")
    app = App([Column("odeform", model, model.rest)], port=0)
    try:
        with LoopbackClient(app.server.get_port()) as client:
            entry = open_dataset("contact-force").select("test")[0]
            client.set("test sequence", entry_label(entry, app.session.schema))
            assert client.until(lambda: not client.controls[START].props["disabled"])
            client.set("by", fit.CORRECTED)
            yield app, client
    finally:
        app.close()


@pytest.fixture
def pushed(pushed_page: View) -> LoopbackClient:
    """The client of that page."""
    return pushed_page[1]


def test_a_fit_of_a_push_can_be_corrected_by_simulations(
    pushed: LoopbackClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fit, "fit_push", telling)
    monkeypatch.setattr(fit, "fit_body", telling_of_the_body)
    for known in (True, False):
        pushed.set(fit.KNOWN, known)
        pushed.click(START)
        # the last step stays while the estimate is simulated
        told = f"{CORRECTIONS} simulations of 20 frames, {known}"
        assert pushed.until(lambda told=told: told in pushed.text())
        assert pushed.until(lambda: "step 1:" in pushed.text())
        pushed.click(CANCEL)
        assert pushed.until(lambda: pushed.controls[START].visible)


def unable(report: Report, *_: object) -> Identification:
    """A fit whose second simulation failed."""
    one = Identified(1.2, 1.0, 1.4, True, 0.0, 0.2)
    return Identification({"mass": one}, 0.5, 9.0, simulations=1, stopped="it is inside out")


def test_a_simulation_that_failed_is_told(pushed: LoopbackClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fit, "fit_push", unable)
    pushed.click(START)
    assert pushed.until(lambda: STOPPED.format(1, CORRECTIONS, "it is inside out") in pushed.text())
    assert pushed.until(lambda: fit.PUSH_OPEN in pushed.text())


DROP = {"height": 0.11, "turn_x": 30.0, "turn_y": -20.0, "turn_z": 0.0, "mass": 0.06, "young": 30.0}


def proposing(report: Report, predictor: Predictor, seen: Known, known: dict[str, Any], _: int) -> Identification:
    """A fit after which a drop would tell most."""
    estimates = {"mass": Identified(0.06, 0.05, 0.07, True, 0.0, 0.2)}
    return Identification(estimates, 0.5, 9.0, DROP, narrowed=0.4, proposed_load="drop")


def test_the_next_experiment_is_one_click_away_under_its_own_load(
    pushed: LoopbackClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fit, "fit_push", proposing)
    body = pushed.controls["object"].value
    pushed.click(START)
    assert pushed.until(lambda: "After the next drop, the widest interval" in pushed.text())
    assert pushed.until(lambda: fit.NEXT.format("push") not in pushed.controls)
    pushed.click(fit.NEXT.format("drop"))
    assert pushed.until(lambda: "height (m)" in pushed.controls)
    assert pushed.until(lambda: pushed.controls["height (m)"].value == pytest.approx(DROP["height"]))
    assert pushed.until(lambda: pushed.controls["turn y (°)"].value == pytest.approx(DROP["turn_y"]))
    assert pushed.until(lambda: pushed.controls["what happens"].value == "Drop it")
    assert pushed.until(lambda: pushed.controls["object"].value == body)


def looking(report: Report, predictor: Predictor, seen: Known, known: dict[str, Any], _: int) -> None:
    """A fit that has estimates, a body of 1.2 times the mass, and looks for the next experiment without end."""
    mass = 1.2 * float(predictor.complete(known)["mass"])
    report(({"mass": mass, "friction": 0.5}, 3.0))
    report(Identification({"mass": Identified(mass, 0.05, 0.07, True, 0.0, 0.2)}, 0.5, 9.0))
    report("Looking for what is next")
    time.sleep(600.0)


@pytest.mark.parametrize("cancelled", [False, True])
def test_estimates_are_there_before_the_next_experiment(
    pushed: LoopbackClient, monkeypatch: pytest.MonkeyPatch, cancelled: bool
) -> None:
    monkeypatch.setattr(fit, "fit_push", looking)
    mass = 1.2 * pushed.controls["mass (kg)"].value
    estimate = f"| **{mass:.3g}** |"
    pushed.click(START)
    assert pushed.until(lambda: "Looking for what is next" in pushed.text() and estimate in pushed.text())
    assert pushed.until(lambda: pushed.controls[CANCEL].visible)
    if cancelled:
        pushed.click(CANCEL)
        assert pushed.until(lambda: "Looking for what is next" not in pushed.text())
        assert estimate in pushed.text(), "estimates stay"
    pushed.click(USE)
    assert pushed.until(lambda: pushed.controls["mass (kg)"].value == pytest.approx(mass, rel=0.01))


def test_only_pushes_are_corrected_by_simulations(dropped: View) -> None:
    assert not {"by", fit.KNOWN} & set(dropped[1].controls)


def found_together(
    report: Report, predictor: Predictor, experiments: list[Recorded], known: dict[str, Any], simulations: int
) -> Identification:
    """A fit of experiments that are known, after which a throw would tell most. Its time tells what was asked."""
    seen = together_points(experiments)
    throw = {p.name: p.default for p in get_load("throw").parameters}
    estimates = {"mass": Identified(0.06, 0.05, 0.07, True, 0.0, 0.2)}
    return Identification(
        estimates,
        0.5,
        len(seen.times) + 100.0 * simulations,
        {**throw, "mass": 0.06, "young": 30.0},
        0.4,
        proposed_load="throw",
    )


def test_a_throw_is_fitted_together_with_the_push_before(pushed_page: View, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fit, "fit_body", found_together)
    app, client = pushed_page
    client.set(fit.KNOWN, True)
    assert not client.controls[fit.TOGETHER].visible, "nothing was fitted before"
    client.click(START)
    assert client.until(lambda: "The search took 320.0 s" in client.text())
    mass = client.controls["mass (kg)"].value
    assert f"| {mass:.3g} |" in client.text(), "the truth is of the object as it is"
    client.click(fit.NEXT.format("throw"))
    assert client.until(lambda: {"height (m)", "mass (kg)", fit.TOGETHER, START} <= set(client.controls))
    assert client.until(lambda: client.controls["mass (kg)"].value == pytest.approx(mass)), "the body that is there"
    assert client.until(lambda: fit.KNOWN not in client.controls), "what falls is known"
    model = app.page.model.predictor
    assert model is not None
    given = app.page.controls.parameters()
    times = np.arange(100) / 100.0
    rest = model.rest_of(given)
    vertices = model.solve(None, given).vertices(times)
    thrown = MotionSequence(times, vertices, rest.faces, surface_weights(rest), given)
    app.panel(TruthPanel).open(thrown)
    assert client.until(lambda: fit.TOGETHER in client.controls and client.controls[fit.TOGETHER].visible)
    client.click(START)
    assert client.until(lambda: "The search took 33.0 s" in client.text())
    assert client.until(lambda: MADE.format(2, "push, throw") in client.text())
    assert client.until(lambda: fit.FALLEN in client.text())
    assert fit.CALIBRATED not in client.text(), "it was measured of single pushes"
    client.set("by", fit.CORRECTED)
    client.click(START)
    assert client.until(lambda: "The search took 333.0 s" in client.text())
    assert [one.made.experiment.load for one in app.page.experiments] == ["push", "throw"], "each once"
    client.set(fit.TOGETHER, False)
    client.click(START)
    assert client.until(lambda: "The search took 313.0 s" in client.text())
    app.panel(TruthPanel).open(
        MotionSequence(times, vertices, rest.faces, surface_weights(rest), {"object": given["object"]})
    )
    assert client.until(lambda: not client.controls[fit.TOGETHER].visible), "it may be another body"
    client.click(START)
    assert client.until(lambda: "expected a throw that is known; height" in client.text())
