"""What has to be known of a motion is said in one sentence each, and nothing where there is nothing to say."""

from dataclasses import fields, replace

import numpy as np
import pytest

from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.motion import base
from odeform.motion.caveats import caveats
from odeform.motion.reduced_motion import ReducedMotion, as_reduced
from odeform.schema import Window

SINKING = {"mass": 1.3, "bending": 0.335, "force": 39.7, "azimuth": 0.0, "elevation": 0.947}


@pytest.fixture(scope="module")
def sinking() -> Predictor:
    """A model whose continuation takes the motion of `SINKING` into the floor."""
    return load("kick/gp")


def test_a_trained_motion_has_none(kick: Predictor) -> None:
    assert caveats(kick.solve(), kick.schema.window.times) == ()


def test_parameters_and_times_outside(kick: Predictor) -> None:
    mass, times = caveats(kick.solve(parameters={"mass": 3.0}), np.array([0.0, 0.5, 1.1]))
    assert mass == "mass = 3 kg is outside the trained range, 0.4 to 1.5 kg"
    assert times == "1 of 3 frames are outside the trained window, 0 to 1 s: there the motion is extrapolated"
    (far,) = caveats(kick.solve(), np.array([0.0, 9.0]))
    assert far.endswith("soon after 4 s it stands still")


def test_the_error_band_of_a_push_follows_how_far_its_motion_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    model = load("contact-force")
    given = model.complete({"object": "flip-flop"})
    times = model.schema.window.times[1:]
    weak = {name: 0.5 * value if name.startswith("force") else value for name, value in given.items()}
    some = [model.solve(parameters=parameters) for parameters in (given, weak)]
    for motion in some:
        moved = motion.vertices(times) - model.rest_of(given).points
        np.testing.assert_allclose(motion.size_mm, 1e3 * np.sqrt((moved**2).mean()), rtol=1e-4)
    strong, light = (motion.error_band(times) for motion in some)
    assert strong is not None
    assert light is not None
    assert some[1].size_mm < 0.8 * some[0].size_mm
    assert (light < 0.9 * strong).all()
    monkeypatch.setattr(base, "FEW", 0)  # of very many points, the trained body is solved
    np.testing.assert_allclose(some[0].error_band(times), strong, rtol=1e-6)


def test_the_error_band_is_that_of_the_trained_body(kick: Predictor) -> None:
    times, egg = np.array([0.1, 0.5]), replace(kick.rest, points=kick.rest.points * np.float32([1.0, 1.0, 0.7]))
    motion = kick.solve()
    band = motion.error_band(times)
    assert band is not None
    np.testing.assert_array_equal(band, kick.error_band(motion.parameters, times))
    assert kick.solve(egg).error_band(times) is None


def test_the_reach_of_a_window_counts_from_its_end(kick: Predictor) -> None:
    motion = as_reduced(kick.solve())
    later = replace(motion, schema=replace(motion.schema, window=Window(0.5, 1.0, 120.0, reach=2.0)))
    assert any(said.endswith("soon after 2 s it stands still") for said in caveats(later, np.array([2.5])))


class Moment(ReducedMotion):
    """A motion of which one moment is predicted."""

    only_at = 0.5


def test_a_single_moment(kick: Predictor) -> None:
    motion = as_reduced(kick.solve())
    moment = Moment(**{field.name: getattr(motion, field.name) for field in fields(motion)})
    assert caveats(moment, np.array([0.5])) == ()
    (said,) = caveats(moment, np.array([0.0, 0.5, 0.7, 1.0]))
    assert said == "only the state at 0.5 s is predicted: 3 of 4 frames are not predictions"


def test_a_motion_that_stops(sinking: Predictor) -> None:
    motion = sinking.solve(parameters=SINKING)
    stop = motion.first_stop()
    assert stop is not None
    assert 2.0 < stop.time < 3.5
    assert motion.status == f"stopped at t = {stop.time:.3f} s: it sinks into the floor afterwards"
    assert f"the motion is stopped at t = {stop.time:.3f} s" in caveats(motion, np.array([3.5]))[-1]
    assert all("stops" not in said for said in caveats(motion, np.array([2.0])))
    assert motion.vertices(3.5)[:, 2].min() == pytest.approx(2.5e-4 - sinking.validity.limits.depth, abs=1e-5)
    assert np.array_equal(motion.vertices(3.9), motion.vertices(3.5))
    assert np.array_equal(motion.pose(3.9), motion.pose(3.5))


def test_another_shape_stops_with_the_trained_body(sinking: Predictor) -> None:
    egg = replace(sinking.rest, points=sinking.rest.points * np.float32([1.0, 1.0, 0.7]))
    motion, trained = sinking.solve(egg, SINKING), sinking.solve(None, SINKING)
    assert motion.untrained
    assert motion.first_stop() == trained.first_stop()
    assert caveats(motion, np.array([0.5]))[0].startswith("this shape was not trained")
