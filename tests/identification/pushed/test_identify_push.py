import re

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.identification.pushed.drawn import drawn_states, forward_of
from odeform.identification.pushed.experiment import Candidates, Experiment, until_halved, widest
from odeform.identification.pushed.halving import report_halved
from odeform.identification.pushed.identify import WIDENED, identifies_pushes, identify_push, model_errors
from odeform.identification.pushed.misled import misled_drawn, report_misled
from odeform.identification.pushed.search import PRIOR
from odeform.identification.pushed.table import identify_drawn, report_drawn
from odeform.identification.pushed.views import CloudView, cloud_of, points_of
from odeform.models.registry import load


@pytest.mark.slow
def test_the_body_and_the_push_of_the_models_own_motion_are_found() -> None:
    predictor = load("contact-force")
    assert identifies_pushes(predictor)
    assert not identifies_pushes(load("contact-force/gp"))
    forward, state = forward_of(predictor, "cat"), drawn_states(predictor, "cat", 1, seed=0)[0]
    seen = points_of(forward.times, forward.motions([state])[0], forward.model.rest.faces, noise_mm=0.2)
    found = identify_push(predictor, seen, {"object": "cat"}, np.zeros(len(forward.times)), propose=True)
    for name, true in zip(("mass", "young", "friction"), state.body, strict=True):
        one = found.parameters[name]
        assert abs(one.unit - true) < 0.1
        assert one.identifiable
    contact = np.array([found.parameters[f"contact_{axis}"].value for axis in "xyz"])
    np.testing.assert_allclose(contact, state.contact, atol=2e-3)
    assert found.misfit < 1.3
    assert found.narrowed < 1.0
    body = {"mass", "young"}
    wanted = {p.name for p in predictor.under(found.proposed_load).schema.parameters}
    assert set(found.proposed) == wanted | body
    with pytest.raises(InputError, match="whole push"):
        identify_push(predictor, seen, {"object": "cat", "force_x": 1.0})


@pytest.mark.slow
def test_a_push_that_is_hardly_seen_says_that_it_is_not_identifiable() -> None:
    predictor = load("contact-force")
    forward, state = forward_of(predictor, "pillow"), drawn_states(predictor, "pillow", 1, seed=1)[0]
    seen = points_of(forward.times[:2], forward.motions([state])[0][:2], forward.model.rest.faces, noise_mm=20.0)
    push = {name: value for name, value in state.parameters().items() if name not in ("mass", "young")}
    found = identify_push(predictor, seen, {"object": "pillow", **push}, np.zeros(2))
    assert not any(one.identifiable for one in found.parameters.values())


@pytest.mark.slow
def test_intervals_are_as_wide_as_bodies_in_the_simulator_took() -> None:
    predictor = load("contact-force")
    forward, state = forward_of(predictor, "dog"), drawn_states(predictor, "dog", 1, seed=1)[0]
    seen = points_of(forward.times, forward.motions([state])[0], forward.model.rest.faces)
    push = {name: value for name, value in state.parameters().items() if name not in ("mass", "young")}
    known = {"object": "dog", **push}
    plain = identify_push(predictor, seen, known, model_errors(predictor, {"object": "dog"}, forward.times))
    calibrated = identify_push(predictor, seen, known)
    for name in ("mass", "young", "friction"):
        one, other = calibrated.parameters[name], plain.parameters[name]
        assert one.value == pytest.approx(other.value)
        assert one.half_width == pytest.approx(WIDENED * other.half_width)


@pytest.mark.slow
def test_drawn_bodies_are_scored_by_how_much_wider_intervals_would_have_to_be() -> None:
    wider = identify_drawn(load("contact-force"), ["chip", "flip-flop", "dog"], 1, noise_mm=1.0)
    assert wider["bodies"] == 3
    ratios = [2.0 * p["error"] / p["half_width"] for row in wider["rows"] for p in list(row["parameters"].values())[:3]]
    assert wider["factor_90"] == pytest.approx(max(ratios)), "of nine, the largest"
    assert f"{wider['factor_90']:.2f} times as wide" in report_drawn(wider)


def test_the_experiment_that_tells_of_what_is_most_open_is_proposed() -> None:
    # the push tells of mass, the drop of friction
    experiments = [Experiment("push", {}), Experiment("drop", {"height": 0.1})]
    found = Candidates(experiments, np.array([np.diag([100.0, 0.0, 0.0]), np.diag([0.0, 0.0, 9.0])]))
    open_friction = np.diag([0.01, 0.01, 0.3])
    assert found.best(open_friction) == 1
    assert widest(found.after(open_friction, 1)) < 0.6 * widest(open_friction)
    assert until_halved(found, open_friction) == [1, 1]
    assert until_halved(found, open_friction, [0, 0, 1, 1]) == [0, 0, 1, 1]
    assert [one.load for one in found.under("push").experiments] == ["push"]
    assert len(until_halved(found.under("push"), open_friction)) == 20, "it never is"


def test_experiments_are_counted_by_load() -> None:
    rows = [
        {"proposed": 1, "random": 3.0, "loads": ["drop"], "pushes": {"proposed": 2, "random": 4.0}},
        {"proposed": 3, "random": 3.0, "loads": ["drop", "push", "drop"], "pushes": {"proposed": 4, "random": 4.0}},
    ]
    text = report_halved({"bodies": 2, "noise_mm": 2.0, "rows": rows})
    assert "of all loads: proposed 2.0 on average, at most two for 50%; random 3.0 on average, 2.0 times" in text
    assert "3 times drop, 1 times push" in text
    assert "of pushes alone: proposed 3.0 on average, at most two for 50%; random 4.0 on average, 1.5 times" in text


def test_how_far_experiments_lead_is_told_by_load() -> None:
    loads = {
        "push": {"experiments": 7, "median": 4.0, "factor_90": 13.9},
        "drop": {"experiments": 1, "median": 2.0, "factor_90": None},
    }
    text = re.sub(" +", " ", report_misled({"loads": loads}))
    assert "push 7 experiments, median 4.0; intervals 13.9 times as wide would hold nine in ten" in text
    assert text.endswith("drop 1 experiments, median 2.0")


@pytest.mark.slow
def test_one_simulated_experiment_of_each_load_is_compared_with_what_it_promised() -> None:
    found = misled_drawn(load("contact-force"), ["flip-flop"], 1)
    assert {row["load"] for row in found["rows"]} == {"push", "drop", "throw"}
    for row in found["rows"]:
        assert (np.array(row["expected"]) < PRIOR).all(), "each tells something"
        assert np.isfinite(row["off"]).all()


@pytest.mark.slow
def test_a_body_in_a_cloud_is_found_where_the_push_is_known() -> None:
    predictor = load("contact-force")
    forward, state = forward_of(predictor, "dog"), drawn_states(predictor, "dog", 1, seed=1)[0]
    seen = cloud_of(forward.times, forward.motions([state])[0], forward.model.rest.faces, CloudView(noise_mm=0.5))
    push = {name: value for name, value in state.parameters().items() if name not in ("mass", "young")}
    found = identify_push(predictor, seen, {"object": "dog", **push}, np.zeros(len(forward.times)))
    for name, true in zip(("mass", "young"), state.body, strict=False):
        assert abs(found.parameters[name].unit - true) < 0.1
