"""Whether bodies move at the end, with a truth that is the model's own motion."""

from pathlib import Path

import numpy as np
import pytest

import odeform
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.motion.recorded import RecordedMotion
from odeform.schema import Parameters
from odeform.types import MotionSequence
from odeform_figures.studies import at_rest

RATE = 100.0  # Hz


@pytest.fixture(scope="module")
def model() -> Predictor:
    return odeform.load("contact-force:slope")


def own(model: Predictor, parameters: Parameters, until: float) -> MotionSequence:
    times = np.linspace(0.0, until, round(until * RATE) + 1)
    motion = model.solve(parameters=parameters)
    count, faces = len(motion.geometry.points), model.rest_of(parameters).faces
    return MotionSequence(
        times, motion.vertices(times), faces, np.full(count, 1.0 / count, np.float32), dict(parameters)
    )


@pytest.mark.slow
def test_the_same_motion_is_judged_alike_and_as_fast_as_it_is_recorded(
    model: Predictor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(at_rest, "simulated", lambda _, parameters, until, keep: own(model, parameters, until))
    found = at_rest.compare("contact-force:slope", 5)
    assert [row["object"] for row in found["rows"]] == ["bottle", "cat", "dog", "donut", "chip"]
    assert (found["simulated"], found["agree"]) == (5, 5)
    assert 0 < found["move"]["model"] == found["move"]["simulation"] < 5
    for row in found["rows"]:
        assert row["simulation"]["mm_per_s"] == pytest.approx(row["model"]["mm_per_s"], rel=0.01, abs=0.1)
    moving = at_rest.compare("contact-force:slope", 5, moving=True)
    assert [row for row in found["rows"] if not row["model"]["rests"]] == moving["rows"]


def test_a_kept_simulation_is_read(model: Predictor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = model.complete({"object": "chip"})
    scene = type("Scene", (), {"simulate": staticmethod(lambda parameters, until: own(model, parameters, until))})
    monkeypatch.setattr(at_rest, "get_scene", lambda _: scene)
    first = at_rest.simulated("object-slope", asked, 0.2, tmp_path)
    monkeypatch.setattr(at_rest, "get_scene", lambda _: None)
    again = at_rest.simulated("object-slope", asked, 0.2, tmp_path)
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(first.vertices, again.vertices)
    assert again.parameters == first.parameters


def test_a_body_that_slides_has_its_speed(model: Predictor) -> None:
    still = own(model, model.complete({"object": "chip"}), 0.2)
    times = still.times
    points = still.vertices[:1] + np.array([0.04, 0.0, 0.0], np.float32) * times[:, None, None].astype(np.float32)
    slides = MotionSequence(times, points, still.faces, still.weights, still.parameters)
    assert at_rest.speed_at(RecordedMotion(model.schema, slides), 0.2) == pytest.approx(0.04, rel=1e-3)


def test_a_model_of_no_objects_is_refused() -> None:
    with pytest.raises(InputError, match="expected a model of objects"):
        at_rest.compare("kick", 1)
