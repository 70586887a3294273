import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.geometry.shape import surface_weights
from odeform.identification.pushed import candidates, identify
from odeform.identification.pushed.corrected import Correction
from odeform.identification.pushed.drawn import drawn_states, forward_of
from odeform.identification.pushed.evidence import Cloud, Known
from odeform.identification.pushed.experiment import Candidates, Experiment
from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.identify import CLOUDED, CORRECTED, WIDENED, identify_body, widening
from odeform.identification.pushed.recorded import recorded_experiment, together_points
from odeform.identification.pushed.search import Found, Problem
from odeform.identification.pushed.state import BODY, PUSH_STEPS, PushState
from odeform.identification.pushed.table import identify_drawn
from odeform.identification.pushed.together import Made, Together, simulated_together
from odeform.identification.pushed.trials import Falls
from odeform.identification.pushed.views import points_of
from odeform.loads.registry import get_load
from odeform.models.registry import load
from odeform.types import Frames, MotionSequence, Times


@pytest.fixture(scope="module")
def forward() -> Forward:
    return forward_of(load("contact-force"), "donut")


@pytest.fixture(scope="module")
def state() -> PushState:
    return drawn_states(load("contact-force"), "donut", 1, seed=0)[0]


@pytest.fixture(scope="module")
def made(forward: Forward, state: PushState) -> list[Made]:
    """A push of a few frames, and a throw."""
    drawn = Falls(forward, state.body, get_load("throw"), 1, seed=0)
    return [
        Made(Experiment("push", state.parameters()), forward.times[:4]),
        Made(drawn.experiments[0], drawn.times[0]),
    ]


def test_frames_of_experiments_follow_each_other(forward: Forward, state: PushState, made: list[Made]) -> None:
    together = Together(forward.model, made)
    (moved,) = together.motions([state])
    assert moved.shape == (4 + 13, *forward.model.rest.points.shape)
    np.testing.assert_allclose(moved[:4], Forward(forward.model, forward.times[:4]).motions([state])[0], atol=1e-9)
    alone = Falls(forward, state.body, get_load("throw"), 1, seed=0).surfaces(state.body)[0]
    np.testing.assert_allclose(moved[4:], alone, atol=1e-6)
    softer = replace(state, body=state.body - np.array([0.0, 0.3, 0.0]), force=np.zeros(3))
    other = together.motions([softer])[0]
    assert np.abs(other[1:4] - moved[1:4]).max() > 1e-4, "the push is that of the experiment"
    assert np.abs(other[5:] - moved[5:]).max() > 1e-4


def test_all_experiments_are_simulated_with_the_body_of_a_state(
    forward: Forward, state: PushState, made: list[Made]
) -> None:
    asked: dict[str, tuple[Experiment, float]] = {}
    all_are_running = threading.Barrier(len(made), timeout=60.0)

    def simulate(experiment: Experiment, friction: float, times: Times) -> Frames:
        asked[experiment.load] = (experiment, friction)
        all_are_running.wait()
        return np.full((len(times), 5, 3), float(experiment.load == "throw"))

    heavier = replace(state, body=np.array([0.5, -0.5, 1.0]))
    surface = simulated_together(Together(forward.model, made), simulate)(heavier)
    np.testing.assert_array_equal(surface[:, 0, 0], [0.0] * 4 + [1.0] * 13)
    for experiment, friction in asked.values():
        assert experiment.parameters["mass"] == heavier.value("mass")
        assert experiment.parameters["young"] == heavier.value("young")
        assert friction == heavier.value("friction")
    assert asked["throw"][0].parameters["height"] == made[1].experiment.parameters["height"]


def test_recorded_falls_are_looked_at_for_120_ms_from_their_first_contact(forward: Forward, made: list[Made]) -> None:
    predictor, given = load("contact-force"), {"object": "donut", **made[1].experiment.parameters}
    rate = get_load("throw").window.rate
    times = np.arange(round(0.5 * rate)) / rate
    vertices = predictor.under("throw").solve(None, given).vertices(times)
    rest = forward.model.rest
    recorded = MotionSequence(times, vertices, rest.faces, surface_weights(rest), given)
    one = recorded_experiment(predictor, "throw", recorded, given)
    np.testing.assert_allclose(one.made.times, made[1].times)
    assert one.surface[0, :, 2].min() < 5e-4 < vertices[:3, :, 2].min()
    push = recorded_experiment(predictor, "push", recorded, {**given, **made[0].experiment.parameters})
    assert push.made.times[0] == 0.0
    both = together_points([push, one])
    assert both.times.tolist() == [*push.made.times, *one.made.times]
    assert np.array_equal(both._on(np.concatenate([push.surface, one.surface])), both.positions)
    with pytest.raises(InputError, match="recorded for 120 ms from its first contact on"):
        recorded_experiment(predictor, "throw", recorded.until(float(one.made.times[3])), given)
    with pytest.raises(InputError, match="vertex by vertex"):
        recorded_experiment(predictor, "throw", replace(recorded, faces=rest.faces[:-1]), given)


def test_what_is_no_experiment_is_refused(forward: Forward, made: list[Made]) -> None:
    predictor, known = load("contact-force"), {"object": "donut"}
    times = made[0].times
    seen = points_of(times, np.zeros((4, *forward.model.rest.points.shape)), forward.model.rest.faces)
    with pytest.raises(InputError, match="at least one experiment"):
        identify_body(predictor, [], seen, known)
    with pytest.raises(InputError, match="points at the times of all experiments"):
        identify_body(predictor, made, seen, known)
    with pytest.raises(InputError, match="pushes, drops and throws, got kick"):
        identify_body(predictor, [Made(Experiment("kick", {}), times)], seen, known)
    with pytest.raises(InputError, match="half to twice"):
        identify_body(predictor, made[:1], seen, {**known, "mass": 100.0})
    with pytest.raises(InputError, match="expected the push to be known"):
        identify_drawn(predictor, ["donut"], 1, falls=["throw"])


def test_a_throw_tells_the_friction_that_a_push_does_not(forward: Forward, state: PushState, made: list[Made]) -> None:
    predictor, known = load("contact-force"), {"object": "donut", "mass": state.value("mass")}
    halves = []
    for some in (made[:1], made):
        together = Together(forward.model, some)
        moved = together.motions([state])[0]
        seen = points_of(together.times, moved, forward.model.rest.faces, noise_mm=1.0)
        found = identify_body(predictor, some, seen, known, np.zeros(len(together.times)))
        assert set(found.parameters) == {"young", "friction"}
        halves.append(found.parameters["friction"].half_width)
        off = found.parameters["friction"].unit - state.body[2]
        assert abs(off) < 1.5 * halves[-1]
    assert halves[1] < 0.3 * halves[0]


def test_intervals_in_clouds_of_known_motions_are_as_wide_as_drawn_bodies_took(forward: Forward) -> None:
    cloud = Cloud(np.zeros(1), [np.zeros((1, 3))], forward.model.rest.faces, 2.0)
    known = Known(cloud.times, np.zeros((1, 1, 3)), cloud.faces, np.zeros(1, dtype=int), np.eye(3)[:1], 2.0)
    every = range(len(BODY) + PUSH_STEPS)
    problem = Problem(forward, cloud, np.zeros(1), (0, 1, 2))
    assert widening(problem, corrected=False, unknown=False) == CLOUDED
    assert widening(replace(problem, evidence=known), corrected=False, unknown=False) == 1.0
    assert widening(replace(problem, free=tuple(every)), corrected=False, unknown=False) == 1.0, "not measured"
    assert widening(problem, corrected=False, unknown=True) == WIDENED
    assert widening(problem, corrected=True, unknown=True) == CORRECTED


@pytest.mark.slow
def test_simulations_correct_the_estimate_and_not_the_next_experiment(
    forward: Forward, state: PushState, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the world that is observed, bodies lie and rebound on another floor."""
    predictor, made = load("contact-force"), [Made(Experiment("push", state.parameters()), forward.times)]
    law = forward.model.contact_parameters
    floor = replace(law, stiffness=0.6 * law.stiffness, damping=0.5 * law.damping)
    world = Together(forward.model.with_contact_parameters(floor), made)

    def simulate(one: Experiment, friction: float, times: Times) -> Frames:
        values = {**one.parameters, "friction": friction}
        body = np.array([r.normalise(values[r.name]) for r in forward.ranges])
        alone = Together(world.model, [Made(one, times)])
        return alone.motions([alone.state(np.zeros(3), np.zeros(3), body)])[0]

    asked: list[Forward] = []

    def looked_for(forward: Forward, *arguments: Any) -> Candidates:
        asked.append(forward)
        return candidates.candidates(forward, *arguments)

    monkeypatch.setattr(identify, "experiment_simulator", lambda *_: simulate)
    monkeypatch.setattr(identify, "candidates", looked_for)
    monkeypatch.setattr(candidates, "PUSHED", 2)
    monkeypatch.setattr(candidates, "FALLING", 1)
    seen = points_of(world.times, world.motions([state])[0], forward.model.rest.faces)
    known = {"object": "donut", "friction": state.value("friction")}
    misses = np.full(len(world.times), 2.0)
    found = [identify_body(predictor, made, seen, known, misses, propose=most > 0, simulations=most) for most in (0, 3)]
    off, left = (
        np.abs([one.parameters[name].unit - unit for name, unit in zip(BODY[:2], state.body, strict=False)])
        for one in found
    )
    assert left.max() < 0.3 * off.max()
    assert found[1].proposed_load
    (one,) = asked
    assert type(one) is Forward, "what corrects these experiments says nothing of others"
    np.testing.assert_allclose(one.times, forward.times)


def test_falls_are_fitted_from_where_the_pushes_lead(
    forward: Forward, state: PushState, made: list[Made], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is simulated of falls is far off where the body is, and leads astray."""
    middle = Found(replace(state, body=np.zeros(3)), np.eye(3), 1.0, True)
    led = replace(middle, state=state)
    asked: list[tuple[int, Found]] = []

    def corrected(problem: Problem, found: Found, *_: object) -> Correction:
        asked.append((len(problem.evidence.times), found))
        return Correction(problem, led, np.zeros(9), 2)

    monkeypatch.setattr(identify, "experiment_simulator", lambda *_: None)
    monkeypatch.setattr(identify, "search", lambda *_: middle)
    monkeypatch.setattr(identify, "corrected_search", corrected)
    together = Together(forward.model, made)
    seen = points_of(together.times, together.motions([state])[0], forward.model.rest.faces)
    for some, parts in ((made, [(4, middle), (17, led)]), (made[:1], [(4, middle)])):
        asked.clear()
        kept = np.arange(17) < sum(len(one.times) for one in some)
        found = identify_body(load("contact-force"), some, seen.at(kept), {"object": "donut"}, simulations=2)
        assert asked == parts
        assert found.parameters["mass"].unit == state.body[0]


def test_some_frames_of_an_observation(forward: Forward) -> None:
    surface = np.random.default_rng(0).normal(size=(3, *forward.model.rest.points.shape))
    known = points_of(np.arange(3.0), surface, forward.model.rest.faces, noise_mm=1.0)
    cloud = Cloud(known.times, [*known.positions], known.faces, 2.0)
    kept = np.array([True, False, True])
    for one, positions in ((known, known.at(kept).positions), (cloud, cloud.at(kept).points)):
        assert one.at(kept).times.tolist() == [0.0, 2.0]
        np.testing.assert_array_equal(positions, known.positions[kept])
