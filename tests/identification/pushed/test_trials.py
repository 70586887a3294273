from functools import cache

import numpy as np
import pytest

from odeform.identification.pushed import state as states
from odeform.identification.pushed.drawn import forward_of
from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.linearised import Linearised, linearised
from odeform.identification.pushed.search import PRIOR
from odeform.identification.pushed.state import BODY, body_steps
from odeform.identification.pushed.trials import Falls, Pushes
from odeform.loads.measured import FALLS, error_after_contact
from odeform.loads.registry import get_load
from odeform.models.registry import load

OTHER = np.array([0.1, -0.2, 0.0])
"""One body that is not the donut's own."""


@cache
def _donut() -> Forward:
    return forward_of(load("contact-force"), "donut")


@cache
def _falls(name: str) -> Falls:
    return Falls(_donut(), OTHER, get_load(name), 1, seed=0)


@cache
def _told(name: str) -> Linearised:
    return linearised(_donut(), _falls(name), OTHER, noise_mm=2.0)


@pytest.fixture
def forward() -> Forward:
    return _donut()


@pytest.fixture(params=FALLS)
def falls(request: pytest.FixtureRequest) -> Falls:
    return _falls(request.param)


def test_falls_are_seen_for_120_ms_from_where_all_bodies_land(forward: Forward, falls: Falls) -> None:
    own, other = falls.surfaces(OTHER), falls.surfaces(OTHER + 0.3)
    assert own.shape == (1, 13, *forward.model.rest.points.shape)
    apart = np.abs(own - other).max(axis=(0, 2, 3))
    assert apart[0] < 0.2 * apart[-1]
    assert own[:, 0, :, 2].min() < 5e-4


def test_models_of_falls_are_as_wrong_as_was_measured(falls: Falls) -> None:
    moved = falls.surfaces(OTHER)
    away = np.sqrt(((moved - moved[:, :1]) ** 2).sum(axis=3).mean(axis=(1, 2)))
    wrong = np.sqrt((falls.errors_mm**2).mean(axis=1))
    np.testing.assert_allclose(wrong, 1e3 * error_after_contact("donut") * away, rtol=0.02)
    assert 0.1 < error_after_contact("dog") < error_after_contact("a body of one's own") < error_after_contact("cat")


def test_falls_tell_of_friction_and_of_stiffness_by_mass(falls: Falls) -> None:
    told = _told(falls.experiments[0].load).informations
    assert told.shape == (1, len(BODY), len(BODY))
    assert (np.diagonal(told, axis1=1, axis2=2).max(axis=0) > PRIOR**-2).all(), "more than what is known beforehand"
    common = np.array([1.0, 1.0, 0.0])
    assert np.abs(told[0] @ common).max() < 1e-3 * np.abs(told[0]).max(), (
        "a body of all mass and stiffness scaled falls alike"
    )


def test_what_falls_tell_does_not_depend_on_the_step_of_differences(
    forward: Forward, falls: Falls, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = _told(falls.experiments[0].load).informations
    monkeypatch.setattr(states, "BODY_STEP", 0.5 * states.BODY_STEP)
    scale = 1.0 / np.sqrt(np.diagonal(told, axis1=1, axis2=2) + PRIOR**-2)
    other = linearised(forward, falls, OTHER, noise_mm=2.0).informations
    assert np.abs((other - told) * scale[:, :, None] * scale[:, None]).max() < 0.25, "standard deviations to an eighth"


def test_another_body_is_found_from_how_it_falls(forward: Forward, falls: Falls) -> None:
    other = np.array([0.02, -0.01, 0.02])
    seen = list(falls.surfaces(OTHER + other))
    found = linearised(forward, falls, OTHER, noise_mm=0.0, observed=seen)
    told = found.informations[0] @ other  # mass and stiffness scaled alike are nearly the same motion
    assert np.linalg.norm(found.scores[0] - told) < 0.2 * np.linalg.norm(told)


@pytest.mark.parametrize("body", [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (-1.0, -1.0, -1.0), (1.0, -1.0, 0.0)])
def test_steps_stay_in_the_ranges_and_tell_all_slopes(body: tuple[float, ...]) -> None:
    for free in ((0, 1, 2), (1,), (0, 1), (1, 2)):
        steps = body_steps(np.array(body), free)
        assert np.abs(body + steps).max() <= 1.0
        assert np.linalg.matrix_rank(steps[:, free]) == len(free)
        assert not np.delete(steps, free, axis=1).any(), "what is known stays as it is"


def test_no_push_is_tried_where_no_sphere_fits(forward: Forward) -> None:
    tried = Pushes(forward, [OTHER], (5.0, 10.0), np.zeros(len(forward.times)), 4, seed=0)
    assert 0 < len(tried.experiments) <= 4
    assert tried.surfaces(OTHER).shape[:2] == (len(tried.experiments), len(forward.times))
