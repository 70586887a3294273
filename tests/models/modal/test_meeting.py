"""Objects that are thrown at a twin of themselves."""

import pickle

import numpy as np
import pytest

import odeform
from odeform.errors import InputError
from odeform.geometry.solids.overlap import overlap
from odeform.geometry.twins import are_twins, half_of, twins_of
from odeform.loads.registry import get_load
from odeform.models.base import Predictor
from odeform.motion.pair_motion import PairMotion
from odeform.schema import OBJECT
from odeform.simulation.scenes.registry import get_scene
from odeform.types import GaussianSplats, Mesh, PointCloud

TIMES = np.linspace(0.0, 0.6, 31)
HEAD_ON = {OBJECT: "donut", **get_load("meet").presets["head on"]}


@pytest.fixture(scope="module")
def meeting() -> Predictor:
    return odeform.load("contact-force:meet")


@pytest.fixture(scope="module")
def motion(meeting: Predictor) -> PairMotion:
    found = meeting.solve(parameters=HEAD_ON)
    assert isinstance(found, PairMotion)
    return found


def test_the_thrown_one_meets_the_one_that_stands(meeting: Predictor, motion: PairMotion) -> None:
    vertices = motion.vertices(TIMES)
    one, other = np.split(vertices, 2, axis=1)
    rest = meeting.rest_of(HEAD_ON)
    parameters = motion.parameters
    middle = rest.points.mean(axis=0) * [1.0, 1.0, 0.0]
    begins = rest.points - middle + [parameters["distance"], parameters["beside"], 0.0]
    np.testing.assert_allclose(other[0], begins, atol=2e-3)
    still = TIMES < 0.1
    np.testing.assert_allclose(other[still], np.tile(other[0], (still.sum(), 1, 1)), atol=1e-4)
    assert other[-1, :, 0].mean() > other[0, :, 0].mean() + 0.05, "it is hit, and slides away"
    assert one[-1, :, 0].mean() < other[-1, :, 0].mean()
    assert vertices[..., 2].min() > -2e-3
    assert motion.status == "ok"
    deepest = max(overlap(Mesh(a, rest.faces), Mesh(b, rest.faces)) for a, b in zip(one, other, strict=True))
    assert deepest < 2e-3
    raw = [np.stack([each.vertices(float(t)) for each in motion.both]) for t in TIMES]
    assert max(overlap(Mesh(a, rest.faces), Mesh(b, rest.faces)) for a, b in raw) > 2e-3, "springs gave way by more"


def test_what_is_shown_is_the_placement_and_the_deformation(motion: PairMotion) -> None:
    for time in TIMES[::6]:
        place = motion.placement(time)
        np.testing.assert_allclose(
            motion.deformed(time) @ place[:3, :3].T + place[:3, 3], motion.vertices(time), atol=3e-6
        )
        pose = motion.pose(time)
        count = len(motion.geometry.points) // 2
        carried = (motion.geometry.points + motion.local(time))[:count] @ pose[:3, :3].T + pose[:3, 3]
        np.testing.assert_allclose(carried, motion.both[0].vertices(time), atol=3e-6)
    assert motion.deformation_bound(0.5) > 0.1


def test_any_time_can_be_asked_for_and_it_can_be_pickled(meeting: Predictor, motion: PairMotion) -> None:
    frames = motion.vertices(TIMES)
    for index in (20, 3, 11):
        np.testing.assert_allclose(motion.vertices(float(TIMES[index])), frames[index], atol=1e-6)
    assert motion.vertices(np.zeros(0)).shape == (0, frames.shape[1], 3)
    again = pickle.loads(pickle.dumps(motion))
    np.testing.assert_array_equal(again.vertices(TIMES), frames)


def test_a_batch_is_each_alone(meeting: Predictor) -> None:
    distances = np.array([0.5, 0.55])
    batch = meeting.solve_batch({**HEAD_ON, "distance": distances})
    for index, distance in enumerate(distances):
        alone = meeting.solve(parameters={**HEAD_ON, "distance": distance})
        np.testing.assert_array_equal(batch.vertices(TIMES)[index], alone.vertices(TIMES))


def test_shapes_of_ones_own_are_two_as_well(meeting: Predictor, motion: PairMotion) -> None:
    rest = meeting.rest_of(HEAD_ON)
    frames, some = motion.vertices(TIMES[::10]), np.arange(0, len(rest.points), 7)
    cloud = meeting.solve(PointCloud(rest.points[some]), HEAD_ON)
    both = np.concatenate([some, len(rest.points) + some])
    np.testing.assert_allclose(cloud.vertices(TIMES[::10]), frames[:, both], atol=2e-4)
    covariances = np.tile(1e-6 * np.eye(3), (len(some), 1, 1))
    splats = GaussianSplats(rest.points[some], covariances, np.zeros((len(some), 1, 3)), np.ones(len(some)))
    moved = meeting.solve(splats, HEAD_ON)
    assert moved.covariances(0.3).shape == (2 * len(some), 3, 3)
    assert are_twins(moved.geometry)
    np.testing.assert_array_equal(half_of(moved.geometry).points, splats.points)
    shown = twins_of(rest)
    assert meeting.solve(shown, HEAD_ON).geometry is shown


def test_truths_are_compared_with_the_motion_of_both(meeting: Predictor, motion: PairMotion) -> None:
    frame = motion.vertices(0.0)
    rest = meeting.to_body_frame(Mesh(frame, meeting.settled(HEAD_ON).faces), HEAD_ON)
    np.testing.assert_array_equal(meeting.solve(rest, HEAD_ON).vertices(0.3), motion.vertices(0.3))


def test_a_heavier_and_softer_pair_meets_too(meeting: Predictor) -> None:
    changed = meeting.solve(parameters={**HEAD_ON, "mass": 0.3, "young": 24.0})
    vertices = changed.vertices(TIMES)
    assert changed.status == "ok"
    assert np.isfinite(vertices).all()
    count = vertices.shape[1] // 2
    assert vertices[-1, count:, 0].mean() > vertices[0, count:, 0].mean() + 0.03


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"distance": 0.05, "height": 0.01}, "inside it"),
        ({"distance": float("inf")}, "distance"),
        ({"distance": 1e9}, "distance, beside: expected at most"),
        ({"other_turn": float("nan")}, "other_turn"),
        ({"height": -0.1}, "height: expected"),
        ({OBJECT: "chip"}, "object"),
    ],
)
def test_what_cannot_happen_is_refused_in_one_line(meeting: Predictor, values: dict[str, float], said: str) -> None:
    with pytest.raises(InputError, match=said) as found:
        meeting.solve(parameters={**HEAD_ON, **values})
    assert "\n" not in str(found.value)


def test_all_draws_of_data_sets_begin_outside(meeting: Predictor) -> None:
    drawn = get_scene("object-meet").sample(16, 1)
    assert len(drawn) == 16 * len(meeting.schema.objects)
    for parameters in drawn:
        get_load("meet").situation(meeting.rest_of(parameters), parameters)
    assert get_scene("object-meet").sample(4, 1, ["dog"]) == get_scene("object-meet").sample(9, 1, ["dog"])[:4]


@pytest.mark.parametrize("name", ["bottle", "cat", "dog", "donut", "flip-flop", "pillow"])
def test_all_presets_of_all_objects_begin(meeting: Predictor, name: str) -> None:
    for values in get_load("meet").presets.values():
        parameters = meeting.complete({OBJECT: name, **values})
        get_load("meet").situation(meeting.rest_of(parameters), parameters)
