"""Predictors and motions can be sent to processes, copied, and asked from several threads at once."""

import copy
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
from operator import methodcaller
from typing import Any

import numpy as np
import pytest

from odeform.checkpoint import bundled_checkpoints
from odeform.models.base import Predictor
from odeform.models.modal.user_body import UserBodyPredictor, resting_body
from odeform.models.registry import load
from odeform.motion.base import Motion
from odeform.simulation.objects.catalog import get_object
from odeform.types import MotionSequence, PointCloud
from tests.threads import THREADS, all_at_once

TIMES = np.array([0.0, 0.02, 0.31])


def again(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


def parameters_of(predictor: Predictor) -> dict[str, float]:
    """Some that are not the defaults, nor at all the same for each."""
    return {p.name: 0.7 * p.default + 0.3 * p.high for p in predictor.schema.parameters if not predictor.schema.objects}


def assert_same(one: Motion, other: Motion) -> None:
    assert dict(one.parameters) == dict(other.parameters)
    np.testing.assert_array_equal(one.vertices(TIMES), other.vertices(TIMES))
    np.testing.assert_array_equal(one.pose(TIMES), other.pose(TIMES))
    assert one.stats.steps == other.stats.steps


@pytest.mark.parametrize("name", sorted(bundled_checkpoints()))
def test_a_predictor_and_its_motion_are_the_same_to_the_bit(name: str) -> None:
    predictor = load(name)
    given, shape, observed = parameters_of(predictor), PointCloud(predictor.rest.points[::40]), None
    if predictor.schema.needs_observations:
        times = predictor.schema.window.times
        still = np.tile(predictor.rest.points, (len(times), 1, 1))
        weights = np.full(len(predictor.rest.points), 1.0 / len(predictor.rest.points))
        observed = MotionSequence(times, still, predictor.rest.faces, weights)
    until = 0.4 * predictor.schema.window.stop
    motion = predictor.solve(shape, given, "draft", until, observed=observed)
    read = again(predictor)
    assert type(read) is type(predictor)
    assert read.checkpoint.sha256 == predictor.checkpoint.sha256
    assert_same(motion, read.solve(shape, given, "draft", until, observed=observed))
    assert_same(motion, again(motion))


def test_a_motion_is_pickled_with_its_geometry_settings_and_end(kick: Predictor) -> None:
    shape, settings = copy.deepcopy(kick.rest), kick.qualities["draft"]
    motion = kick.solve(shape, {"azimuth": 0.4}, settings, 0.1)
    read = again(motion)
    np.testing.assert_array_equal(read.geometry.points, shape.points)
    assert read.stats.solver == motion.stats.solver
    assert_same(read, motion)
    assert_same(copy.copy(motion), motion)


def test_a_pickle_holds_no_caches(kick: Predictor) -> None:
    predictor = load("kick")
    fresh = len(pickle.dumps(predictor))
    predictor.solve_batch({"mass": np.array([0.5, 0.6])}).vertices(0.1)
    # a list of names is kept, and which strings are shared differs; the least array of a motion is larger
    assert len(pickle.dumps(predictor)) < fresh + 1_000


@pytest.mark.slow
def test_a_predictor_of_a_user_body() -> None:
    predictor = UserBodyPredictor(load("contact-force"), resting_body(get_object("bottle"), "bottle"))
    given = predictor.parameters_like()
    motion = predictor.solve(None, given)
    assert_same(again(predictor).solve(None, given), motion)
    assert_same(again(motion), motion)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["kick", "contact-force"])
def test_processes_that_share_no_memory(name: str) -> None:
    predictor = load(name)
    motion = predictor.solve()
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        shown = pool.submit(methodcaller("vertices", 0.05), motion)
        solved = pool.submit(methodcaller("solve"), predictor)
        np.testing.assert_allclose(shown.result(), motion.vertices(0.05), atol=1e-7)  # on another number of threads
        assert_same(solved.result(), motion)


@pytest.mark.parametrize("name", ["kick", "mass-elastic", "contact-force", "kick/gp", "mass-elastic/node"])
def test_eight_threads_that_solve_at_once_are_the_same_to_the_bit_as_one(name: str) -> None:
    shared, alone = load(name), load(name)
    names = [p for p in alone.schema.parameters if p.name != "azimuth" and not p.name.startswith("contact")]
    share = np.linspace(0.1, 0.9, THREADS)
    given = [{names[0].name: float(names[0].low + s * (names[0].high - names[0].low))} for s in share]
    if alone.schema.objects:
        given = [{"object": alone.schema.objects[index % 3]} for index in range(THREADS)]

    def shown(predictor: Predictor, index: int) -> tuple[Any, Any]:
        motion = predictor.solve(PointCloud(predictor.rest.points[::9]), given[index], "draft", 0.1)
        return motion.vertices(0.05 + 0.1 * index), motion.pose(TIMES)

    for (points, poses), index in zip(
        all_at_once(lambda index: shown(shared, index), range(THREADS)), range(THREADS), strict=True
    ):
        expected = shown(alone, index)
        np.testing.assert_array_equal(points, expected[0])
        np.testing.assert_array_equal(poses, expected[1])
