"""A model that is wrong, corrected by what it stands for."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.identification.pushed import corrected
from odeform.identification.pushed.corrected import Corrected, corrected_search
from odeform.identification.pushed.drawn import drawn_states, forward_of
from odeform.identification.pushed.experiment import Experiment
from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.identify import identify_push
from odeform.identification.pushed.search import Found, Problem, search
from odeform.identification.pushed.simulator import can_simulate, simulator_of
from odeform.identification.pushed.state import PushState
from odeform.identification.pushed.table import identify_drawn, report_drawn
from odeform.identification.pushed.together import Made, Together
from odeform.identification.pushed.views import points_of
from odeform.loads.registry import PUSH
from odeform.models.registry import load
from odeform.simulation.errors import SimulationError
from odeform.types import Frames


class _Straight(Forward):
    """Motions that are linear in the state."""

    def motions(self, states: Sequence[PushState]) -> Frames:
        steps = np.arange(9.0) + 1.0
        return np.stack([np.full((2, 4, 3), steps @ state.vector) for state in states])


def _forward(kind: type[Forward]) -> tuple[Forward, PushState]:
    predictor = load("contact-force")
    known = forward_of(predictor, "dog")
    out = kind.__new__(kind)
    vars(out).update(vars(known))
    return out, drawn_states(predictor, "dog", 1, seed=0)[0]


def test_the_corrected_model_is_exact_where_it_was_simulated_and_along_the_way() -> None:
    forward, state = _forward(_Straight)
    slope = np.array([0.5, -2.0, 1.0])

    def truth(one: PushState) -> Frames:
        return forward.motions([one])[0] + 3.0 + slope @ one.body

    first = Corrected(forward).with_simulated(state, truth(state))
    np.testing.assert_allclose(first.motions([state])[0], truth(state))
    other = replace(state, body=state.body + 2.0 * np.eye(3)[1])
    np.testing.assert_allclose(first.motions([other])[0], truth(other) - slope[1] * 2.0)
    both = first.with_simulated(other, truth(other))
    np.testing.assert_allclose(both.motions([other])[0], truth(other))
    # of what was not looked at before, nothing is said; of the way between both, nearly all
    between = replace(state, body=state.body + np.eye(3)[1])
    np.testing.assert_allclose(both.motions([between])[0], truth(between), atol=6e-3)


@pytest.mark.slow
@pytest.mark.parametrize("together", [False, True])
def test_the_body_is_found_by_a_model_that_is_wrong(together: bool) -> None:
    predictor = load("contact-force")
    forward, state = forward_of(predictor, "dog"), drawn_states(predictor, "dog", 1, seed=0)[0]
    # in the world that is observed, bodies lie and rebound on another floor
    law = forward.model.contact_parameters
    floor = replace(law, stiffness=0.6 * law.stiffness, damping=0.5 * law.damping)
    world = Forward(forward.model.with_contact_parameters(floor), forward.times)
    seen = points_of(forward.times, world.motions([state])[0], forward.model.rest.faces)
    start = replace(state, body=np.zeros(3))
    if together:  # what was made is known to the model, and not of the state
        made = [Made(Experiment(PUSH, state.parameters()), forward.times)]
        forward = Together(forward.model, made)
        start = forward.state(np.zeros(3), np.zeros(3))
    problem = Problem(forward, seen, np.full(len(forward.times), 2.0), (0, 1, 2))
    found = search(problem, start)
    told: list[str] = []
    better = corrected_search(
        problem, found, lambda one: world.motions([replace(state, body=one.body)])[0], 4, note=told.append
    )
    off, left = (np.abs(one.state.body - state.body) for one in (found, better.found))
    assert better.simulations == len(told) > 0
    assert 0.0 < np.abs(better.last).max() < off.max(), "steps grow shorter"
    assert off.max() > 0.5
    assert left[:2].max() < 0.1, "mass and stiffness"
    assert left[2] < 0.5 * off[2], "friction, of which the push hardly tells"

    def broken(_: PushState) -> Frames:
        raise SimulationError("it is inside out")

    nothing = corrected_search(problem, found, broken, 4)
    assert (nothing.problem, nothing.found, nothing.simulations) == (problem, found, 0)
    assert nothing.stopped == "it is inside out"


@pytest.mark.slow
def test_a_simulated_body_is_found_nearer_with_a_simulation() -> None:
    predictor = load("contact-force")
    found = identify_drawn(predictor, ["pillow"], 1, from_simulator=True, known=("push",), simulations=1)
    alone = identify_drawn(predictor, ["pillow"], 1, from_simulator=True, known=("push",))
    errors = [np.mean([p["error"] for p in one["rows"][0]["parameters"].values()]) for one in (found, alone)]
    assert errors[0] < errors[1]
    assert set(found["parameters"]) == {"mass", "young", "friction"}
    assert "1 simulations" in report_drawn(found)
    with pytest.raises(InputError, match="not the model"):
        identify_drawn(predictor, ["pillow"], 1, simulations=1)


def test_what_cannot_be_simulated_is_not() -> None:
    predictor = load("contact-force")
    assert can_simulate(predictor)
    forward, state = forward_of(predictor, "dog"), drawn_states(predictor, "dog", 1, seed=0)[0]
    with pytest.raises(InputError, match="no solid"):
        simulator_of(forward, "a boot")
    assert not can_simulate(forward.model)
    seen = points_of(
        forward.times, np.zeros((len(forward.times), len(forward.model.rest.points), 3)), forward.model.rest.faces
    )
    with pytest.raises(InputError, match="mechanical"):
        identify_push(load("mass-elastic"), seen, state.parameters(), simulations=1)


def test_an_estimate_beside_which_no_sphere_fits_ends_the_corrections() -> None:
    forward, state = forward_of(load("contact-force"), "dog"), drawn_states(load("contact-force"), "dog", 1, seed=0)[0]
    points = forward.model.rest.points
    below = replace(state, contact=points[points[:, 2].argmin()], force=np.array([0.0, 0.0, 1.0]))
    with pytest.raises(SimulationError, match="does not fit"):
        simulator_of(forward, "dog")(below)


def test_an_estimate_at_the_end_of_a_range_is_first_simulated_in_its_middle(monkeypatch: pytest.MonkeyPatch) -> None:
    forward, state = forward_of(load("contact-force"), "dog"), drawn_states(load("contact-force"), "dog", 1, seed=0)[0]
    forward = Forward(forward.model, forward.times[:3])
    state = replace(state, body=np.array([0.2, -1.0, 1.0]))
    surface = forward.motions([state])[0]
    problem = Problem(forward, points_of(forward.times, surface, forward.model.rest.faces), np.ones(3), (0, 2))
    found, simulated = Found(state, np.eye(2), 1.0, True), list[list[float]]()

    def simulate(one: PushState) -> Frames:
        simulated.append(one.body.tolist())
        return surface + 0.01

    monkeypatch.setattr(corrected, "refined", lambda *_: found)
    corrected_search(problem, found, simulate, 2)
    assert simulated == [[0.2, -1.0, 0.0], [0.2, -1.0, 1.0]], "stiffness is known"
