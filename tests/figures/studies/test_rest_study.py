"""Pushes that are compared until they rest, with a truth that is the model's own motion."""

import numpy as np
import pytest

import odeform
from odeform.models.base import Predictor
from odeform_figures.studies.rest import Push, compare

ENDS = 0.3  # s


@pytest.fixture(scope="module")
def model() -> Predictor:
    return odeform.load("contact-force")


def pushed(model: Predictor, ends: float) -> Push:
    """The chip's default push as the model says it, until a time at which it rests."""
    parameters = model.complete({"object": "chip"})
    times = np.linspace(0.0, ends, round(400 * ends) + 1)
    vertices = model.solve(parameters=parameters).vertices(times)
    count = vertices.shape[1]
    return Push(parameters, times, vertices, np.full(count, 1.0 / count, np.float32))


def test_a_truth_that_ended_because_the_body_rests_holds_afterwards(model: Predictor) -> None:
    row = compare(model, [pushed(model, ENDS)], 0.8)["chip"]
    assert row["times_s"] == [0.05, 0.1, 0.19, 0.3, 0.5, 0.8]
    assert max(row["rmse_mm"][:4]) < 1e-3
    assert row["rmse_mm"][5] < 0.1, "the chip lies still by then"
    assert (row["pushes"], row["placed_at_the_end"], row["better_than_standing_still"]) == (1, 1, 1)


def test_a_body_in_another_place_is_not_placed(model: Predictor) -> None:
    push = pushed(model, ENDS)
    away = Push(push.parameters, push.times, push.vertices + np.float32([0.02, 0.0, 0.0]), push.weights)
    row = compare(model, [away], ENDS)["all"]
    assert row["times_s"][-1] == 0.3
    assert row["rmse_mm"][-1] == pytest.approx(20.0 / np.sqrt(3.0), rel=0.01)
    assert row["placed_at_the_end"] == 0
