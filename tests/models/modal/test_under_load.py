"""Objects that are dropped, thrown and kicked by a model that was trained on pushes."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import odeform
from odeform.checkpoint import read_checkpoint, resolve_checkpoint
from odeform.errors import InputError
from odeform.loads.registry import known_loads
from odeform.models.base import Predictor
from odeform.models.modal.model import QUALITIES, ModalModel
from odeform.models.modal.user_body import UserBodyPredictor, resting_body
from odeform.models.registry import load_model
from odeform.simulation.objects.catalog import get_object
from odeform.types import PointCloud

TIMES = np.linspace(0.0, 0.6, 13)


@pytest.fixture(scope="module")
def pushed() -> Predictor:
    return odeform.load("contact-force")


@pytest.fixture(scope="module")
def thrown(pushed: Predictor) -> Predictor:
    return pushed.under("throw")


def test_a_model_of_mechanics_takes_all_loads_and_leads_back(pushed: Predictor, thrown: Predictor) -> None:
    assert pushed.loads == known_loads()
    assert thrown.under("push") is pushed
    assert thrown.under("drop").schema.scene == "object-drop"
    assert odeform.load("contact-force:kick").schema.scene == "object-kick"


def test_steps_of_a_body_that_lands_are_as_long_as_its_errors_allow(pushed: Predictor) -> None:
    """Those of one that is held or kicked are shorter: its errors are smaller."""
    drop = pushed.under("drop")
    sure = drop.solve(parameters={"object": "donut"}, quality=replace(QUALITIES["balanced"], tolerance=2e-5))
    points = [motion.vertices(TIMES) for motion in (drop.solve(parameters={"object": "donut"}), sure)]
    off, moved = points[0] - points[1], points[1] - points[1][0]
    assert np.sqrt((off**2).mean() / (moved**2).mean()) < 0.03
    tolerances = {name: pushed.under(name).qualities["balanced"].tolerance for name in ("drop", "hold", "kick")}
    assert tolerances == {"drop": 2.5e-4, "hold": 1.5e-4, "kick": 1.5e-4}


@pytest.mark.parametrize("load", ["drop", "kick"])
def test_each_object_has_its_own_mass_and_stiffness_unless_told(pushed: Predictor, load: str) -> None:
    model = pushed.under(load)
    for name in ("bottle", "donut"):
        item, complete = get_object(name), model.complete({"object": name})
        assert complete["mass"] == pytest.approx(item.mass, rel=1e-6)
        assert complete["young"] == pytest.approx(1e-3 * item.material.young, rel=1e-6)
        assert not model.model_of(complete).is_changed(complete)
    assert model.complete({"object": "donut", "mass": 0.25})["mass"] == 0.25


def test_a_kicked_body_meets_the_floor_as_training_chose() -> None:
    known = read_checkpoint(resolve_checkpoint("contact-force"))
    laws = {}
    for option in (None, "impact"):
        part = {key: value for key, value in known.config["objects"]["donut"].items() if key != "kicked_as"}
        objects = {**known.config["objects"], "donut": part if option is None else {**part, "kicked_as": option}}
        model = load_model(replace(known, config={**known.config, "objects": objects}))
        for scene in (model, model.under("kick"), model.under("drop")):
            parts = scene.model_of({"object": "donut"})
            assert isinstance(parts, ModalModel)
            laws[option, scene.schema.scene] = parts.contact_parameters
    assert laws[None, "object-kick"] == laws[None, "contact-force"] == laws["impact", "contact-force"]
    assert laws["impact", "object-kick"] == laws["impact", "object-drop"] != laws[None, "object-kick"]


def test_other_models_refuse_in_words() -> None:
    kick = odeform.load("kick")
    assert kick.loads == ()
    with pytest.raises(InputError, match="knows the motions of its training data only"):
        kick.under("drop")
    with pytest.raises(InputError, match="unknown load"):
        odeform.load("contact-force").under("hop")


@pytest.mark.parametrize("name", ["bottle", "cat", "dog", "donut", "chip", "flip-flop", "pillow"])
def test_each_object_begins_in_the_air_and_stays_above_the_floor(thrown: Predictor, name: str) -> None:
    motion = thrown.solve(parameters={"object": name, "height": 0.1, "velocity_z": 0.0})
    vertices = motion.vertices(TIMES)
    assert vertices[0, :, 2].min() == pytest.approx(0.1, abs=1e-4)
    assert np.isfinite(vertices).all()
    assert vertices[:, :, 2].min() > -2e-3
    assert vertices[-1, :, 2].min() < 5e-3, "it has landed"


def test_what_is_shown_is_the_pose_and_the_deformation(thrown: Predictor) -> None:
    """Flat on the floor in both."""
    motion = thrown.solve(parameters={"object": "pillow", "height": 0.1})
    for time in TIMES:
        pose = motion.pose(time)
        placed = motion.deformed(time) @ pose[:3, :3].T + pose[:3, 3]
        np.testing.assert_allclose(placed, motion.vertices(time), atol=2e-6)


def test_a_kick_begins_where_the_body_rests(pushed: Predictor) -> None:
    kicked = pushed.under("kick")
    for values in ({}, {"mass": 0.3}):
        parameters = kicked.complete({"object": "donut", **values})
        motion = kicked.solve(parameters=parameters)
        np.testing.assert_array_equal(motion.vertices(0.0), kicked.settled(parameters).points)
        assert np.linalg.norm(motion.vertices(0.1) - motion.vertices(0.0), axis=1).max() > 1e-3


def test_a_heavier_kicked_body_moves_less(pushed: Predictor) -> None:
    kicked = pushed.under("kick")
    moved = [
        np.abs(
            np.diff(kicked.solve(parameters={"object": "donut", "mass": mass}).vertices(np.array([0.0, 0.1])), axis=0)
        ).max()
        for mass in (0.2, 0.39)
    ]
    assert moved[1] < 0.7 * moved[0]


def test_points_of_any_shape_move_along(thrown: Predictor) -> None:
    rest = thrown.rest_of({"object": "donut"})
    some = PointCloud(rest.points[::7])
    parameters = {"object": "donut", "height": 0.2}
    moved, whole = (thrown.solve(shape, parameters).vertices(0.3) for shape in (some, None))
    np.testing.assert_allclose(moved, whole[::7], atol=3e-4, err_msg="modes between vertices are interpolated")


def test_a_batch_is_as_each_motion_alone(thrown: Predictor) -> None:
    heights = np.array([0.08, 0.2])
    batch = thrown.solve_batch({"object": "donut", "height": heights})
    for index, height in enumerate(heights):
        alone = thrown.solve(parameters={"object": "donut", "height": height})
        np.testing.assert_allclose(batch.vertices(TIMES)[index], alone.vertices(TIMES), atol=1e-6)


def test_motions_do_not_depend_on_how_one_scrubbed_there(thrown: Predictor) -> None:
    one, other = (thrown.solve(parameters={"object": "flip-flop"}) for _ in range(2))
    forward = [one.vertices(float(time)) for time in TIMES]
    for index in (7, 2, 12):
        np.testing.assert_array_equal(other.vertices(float(TIMES[index])), forward[index])


def test_no_error_is_claimed_under_a_load_that_was_not_measured(pushed: Predictor, thrown: Predictor) -> None:
    parameters = thrown.complete({"object": "donut"})
    assert thrown.error_band(parameters, TIMES) is None
    pushes = pushed.complete({"object": "donut"})
    assert pushed.error_band(pushes, np.array([0.05, 0.1])) is not None


def test_it_survives_files_and_pickles(thrown: Predictor, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("thrown") / "thrown.safetensors"
    thrown.save(path)
    expected = thrown.solve(parameters={"object": "donut"}).vertices(0.3)
    for again in (odeform.load(path), pickle.loads(pickle.dumps(thrown))):
        np.testing.assert_array_equal(again.solve(parameters={"object": "donut"}).vertices(0.3), expected)


def test_a_body_of_ones_own_takes_them_too(pushed: Predictor) -> None:
    own = UserBodyPredictor(pushed, resting_body(get_object("donut"), "donut"))
    motion = own.under("drop").solve(parameters={"height": 0.15, "turn_x": 90.0})
    assert motion.vertices(0.0)[:, 2].min() == pytest.approx(0.15, abs=1e-4)
    assert own.under("drop").error_band(motion.parameters, TIMES) is None


@pytest.mark.parametrize("values", [{"height": -0.1}, {"spin_x": 1e4}, {"mass": 0.0}, {"young": -3.0}])
def test_bad_values_are_refused(thrown: Predictor, values: dict[str, float]) -> None:
    with pytest.raises(InputError):
        thrown.solve(parameters={"object": "donut", **values})


def test_extremes_stay_finite(thrown: Predictor) -> None:
    for values in (
        {"mass": 0.02},
        {"mass": 5.0},
        {"young": 1.0},
        {"young": 3e3},
        {"velocity_z": -8.0},
        {"spin_y": 60.0},
    ):
        motion = thrown.solve(parameters={"object": "donut", "height": 0.05, **values})
        assert np.isfinite(motion.vertices(TIMES)).all(), values
        assert motion.status
