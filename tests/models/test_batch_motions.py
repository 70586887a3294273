"""Many motions in one call: each is as it is alone."""

import pickle
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import odeform
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.motion.motion_batch import MotionBatch
from odeform.simulation.scenes.registry import find_scene
from odeform.solver.integrate import SolverSettings

SAME = 1e-6  # m
FAMILIES = ["kick", "mass-elastic", "mass-elastic/odeform-rolling", "contact-force"]


def drawn(predictor: Predictor, count: int) -> dict[str, Any]:
    """Arrays of random parameters; in a scene with objects, of pushes of the default one."""
    schema = predictor.schema
    if schema.objects:
        scene = find_scene(schema.scene)
        assert scene is not None
        sets = list(scene.sample(count, 0, schema.objects[:1]))
        names = [name for name in sets[0] if name != "object"]
        return {"object": schema.objects[0], **{name: np.array([given[name] for given in sets]) for name in names}}
    rng = np.random.default_rng(0)
    return {
        p.name: 0.3 if p.role == "azimuth" else np.array([p.denormalise(u) for u in rng.uniform(-1.0, 1.0, count)])
        for p in schema.parameters
    }


def one_of(given: Mapping[str, Any], index: int) -> dict[str, Any]:
    return {name: value[index] if isinstance(value, np.ndarray) else value for name, value in given.items()}


def assert_equals_single_motions(
    predictor: Predictor, batch: MotionBatch, given: Mapping[str, Any], times: Any, **settings: Any
) -> None:
    points, poses = batch.vertices(times), batch.pose(times)
    assert points.dtype == np.float32
    for index in range(len(batch)):
        motion = predictor.solve(parameters=one_of(given, index), **settings)
        np.testing.assert_allclose(points[index], motion.vertices(times), rtol=0.0, atol=SAME)
        np.testing.assert_allclose(poses[index], motion.pose(times), rtol=0.0, atol=1e-5)


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("quality", ["draft", "balanced"])
def test_families_solve_many_motions_as_each_alone(name: str, quality: str) -> None:
    predictor = load(name)
    count = 3 if predictor.schema.objects else 9
    given = drawn(predictor, count)
    batch = predictor.solve_batch(given, quality)
    times = np.array([0.0, 0.011, 0.2, 0.7]) * predictor.schema.window.stop
    assert_equals_single_motions(predictor, batch, given, times, quality=quality)
    assert_equals_single_motions(predictor, batch, given, 0.05, quality=quality)
    for index, stats in enumerate(batch.stats):
        alone = predictor.solve(parameters=one_of(given, index), quality=quality).stats
        assert (stats.solver, stats.status) == (alone.solver, alone.status)
        assert (stats.steps, stats.evaluations, stats.rejected) == (alone.steps, alone.evaluations, alone.rejected)


@pytest.mark.parametrize("name", FAMILIES)
def test_motions_go_on_after_the_window_as_each_alone(name: str) -> None:
    predictor = load(name)
    given = drawn(predictor, 2 if predictor.schema.objects else 4)
    batch = predictor.solve_batch(given, "draft", until=0.3)
    window = predictor.schema.window
    assert_equals_single_motions(predictor, batch, given, window.stop * np.array([0.5, 1.1, 1.4, 9.0]), quality="draft")


def test_a_motion_that_is_held_is_held_as_alone() -> None:
    predictor = load("kick")
    # bodies that may deform less than the trained ones do: some motions end early, others do not
    predictor.validity = replace(predictor.validity, limits=replace(predictor.validity.limits, deformation=0.4))
    given = {"mass": np.geomspace(0.4, 1.5, 6), "force": np.linspace(160.0, 90.0, 6)}
    batch = predictor.solve_batch(given, "draft")
    times = predictor.schema.window.times[::12]
    assert_equals_single_motions(predictor, batch, given, times, quality="draft")
    alone = [predictor.solve(parameters=one_of(given, index), quality="draft").status for index in range(6)]
    assert list(batch.status) == alone
    assert len({"held at" in status for status in alone}) == 2


def test_a_motion_whose_solver_fails_is_as_alone() -> None:
    predictor, given = load("kick"), {"mass": np.array([0.5, 0.9])}
    settings = SolverSettings("euler", step=0.05, dtype="float64")
    batch = predictor.solve_batch(given, settings)
    assert_equals_single_motions(predictor, batch, given, np.array([0.1, 0.8]), quality=settings)
    assert [stats.status for stats in batch.stats] == [
        predictor.solve(parameters=one_of(given, index), quality=settings).stats.status for index in range(2)
    ]


def test_every_motion_may_have_an_azimuth() -> None:
    predictor = load("kick")
    given = {"azimuth": np.array([0.3, -1.2, 0.3]), "mass": np.array([0.5, 0.6, 0.7])}
    batch = predictor.solve_batch(given, "draft")
    assert_equals_single_motions(predictor, batch, given, np.array([0.04, 0.5]), quality="draft")


def test_more_motions_than_are_solved_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    predictor = load("kick")
    given = drawn(predictor, 7)
    whole = predictor.solve_batch(given, "draft").vertices(0.3)
    monkeypatch.setattr(type(predictor), "together", 3)
    np.testing.assert_array_equal(predictor.solve_batch(given, "draft").vertices(0.3), whole)


@pytest.mark.parametrize("name", ["kick/gp", "mass-elastic/nearest", "mass-elastic/pod-rbf", "mass-elastic/direct"])
def test_every_other_model_solves_them_one_by_one(name: str) -> None:
    predictor = load(name)
    given = drawn(predictor, 3)
    batch = predictor.solve_batch(given)
    assert_equals_single_motions(predictor, batch, given, np.array([0.0, 0.1, 0.4]))


def test_what_a_batch_is(kick: Predictor) -> None:
    masses = np.linspace(0.5, 1.0, 4)
    batch = kick.solve_batch({"mass": masses, "force": 140}, geometry=odeform.PointCloud(kick.rest.points[:7]))
    assert len(batch) == 4
    np.testing.assert_array_equal(batch.parameters["mass"], masses)
    assert batch.parameters["force"].tolist() == [140.0] * 4
    assert tuple(batch.parameters) == kick.schema.names
    assert batch.vertices(0.1).shape == (4, 7, 3)
    assert batch.vertices(np.array([0.1])).shape == (4, 1, 7, 3)
    assert batch.pose(0.1).shape == (4, 4, 4)
    assert batch[-1].parameters["mass"] == 1.0
    assert [motion.parameters["mass"] for motion in batch[1:3]] == masses[1:3].tolist()
    assert batch[2] is batch[2]
    assert len(list(batch)) == 4
    with pytest.raises(IndexError):
        batch[4]


@pytest.mark.parametrize("name", FAMILIES)
def test_a_batch_of_one_is_a_batch(name: str) -> None:
    predictor = load(name)
    given = drawn(predictor, 1)
    batch = predictor.solve_batch(given, "draft")
    times = np.array([0.5, 1.0]) * predictor.schema.window.stop
    assert batch.vertices(times).shape[:2] == (1, 2)
    assert_equals_single_motions(predictor, batch, given, times, quality="draft")


def test_vectors_and_names() -> None:
    predictor = load("contact-force")
    given = drawn(predictor, 3)
    forces = np.stack([given[f"force_{axis}"] for axis in "xyz"], axis=1)
    contact = np.array([given[f"contact_{axis}"][0] for axis in "xyz"])
    batch = predictor.solve_batch(
        {"object": given["object"], "contact": contact, "force": forces[:1] * np.array([[1.0], [0.5]])}, "draft"
    )
    assert batch.parameters["object"] == given["object"]
    np.testing.assert_array_equal(batch.parameters["force_z"], forces[0, 2] * np.array([1.0, 0.5]))
    np.testing.assert_array_equal(batch.parameters["contact_x"], contact[[0, 0]])


def test_a_batch_that_is_pickled_is_the_same(kick: Predictor) -> None:
    batch = kick.solve_batch({"mass": np.array([0.5, 0.8])}, "draft")
    read = pickle.loads(pickle.dumps(batch))
    np.testing.assert_array_equal(read.vertices(0.2), batch.vertices(0.2))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"mass": np.ones(3), "force": np.full(2, 140.0)}, "expected arrays of one length, got 3 of mass, 2 of force"),
        ({"mass": np.ones(0)}, "expected at least one motion, got an empty array of mass"),
        ({"mass": 0.5}, r"expected at least one parameter as an array \(B,\), got none"),
        ({"mass": np.ones((2, 2))}, r"mass: expected a number, or an array \(B,\), got shape \(2, 2\)"),
        ({"mass": np.array([0.5, np.nan])}, "motion 1 of 2: mass: expected a finite number in kg, got nan"),
        ({"mass": np.array([0.5, -1.0])}, "motion 1 of 2: mass: expected a positive number in kg, got -1"),
        ({"mass": [0.5, "heavy"]}, r"mass: expected numbers, or an array \(B,\) of them, got"),
        ({"weight": np.ones(2)}, "unknown parameter 'weight': scene kick has mass"),
    ],
)
def test_bad_input_is_one_clear_line(kick: Predictor, given: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        kick.solve_batch(given)


def test_bad_vectors_and_objects() -> None:
    predictor = load("contact-force")
    with pytest.raises(InputError, match=r"force: expected three numbers, or an array \(B, 3\), got shape \(2,\)"):
        predictor.solve_batch({"force": np.ones(2)})
    with pytest.raises(InputError, match="object: expected one name that all motions share"):
        predictor.solve_batch({"object": ["dog", "cat"], "force": np.ones((2, 3))})
    with pytest.raises(InputError, match="unknown quality 'best'"):
        load("kick").solve_batch({"mass": np.ones(2)}, "best")
