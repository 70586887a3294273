"""How far a frame can be trusted, in a word and a colour."""

import pytest

import odeform
from odeform.models.base import Predictor
from odeform_viz.columns import Column, Columns
from odeform_viz.panels.summary import badge_of
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest


@pytest.fixture(scope="module")
def pushed() -> Predictor:
    return odeform.load("contact-force")


@pytest.mark.parametrize(
    ("ratio", "level", "text"),
    [
        (1.0, "inside", "inside the trained range"),
        (0.5, "outside", "hardly tested"),
        (2.0, "outside", "hardly tested"),
        (3.0, "unknown", "not tested"),
    ],
)
def test_a_body_of_another_mass_is_tested_from_half_to_twice_its_own(
    pushed: Predictor, ratio: float, level: str, text: str
) -> None:
    own = pushed.complete({"object": "chip"})
    columns = Columns.of([Column("odeform", pushed, pushed.rest_of(own))]).all
    request = ViewRequest({**own, "mass": ratio * own["mass"]}, 0.05, "balanced", columns)
    badge = badge_of(Session(pushed.schema).frame(request))
    assert (badge.level, badge.text) == (level, text)
    assert badge.detail.startswith("mass or stiffness") == (ratio != 1.0)
