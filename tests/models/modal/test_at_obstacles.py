"""Objects that are thrown against a wall, onto a step, and let down on a slope."""

import numpy as np
import pytest

import odeform
from odeform.errors import InputError
from odeform.loads.registry import get_load
from odeform.models.base import Predictor
from odeform.schema import OBJECT
from odeform.simulation.scenes.registry import get_scene

TIMES = np.linspace(0.0, 0.8, 41)


@pytest.fixture(scope="module")
def pushed() -> Predictor:
    return odeform.load("contact-force")


@pytest.mark.parametrize("load", ["wall", "step", "slope"])
def test_nothing_is_shown_inside_an_obstacle_or_called_implausible(pushed: Predictor, load: str) -> None:
    model = pushed.under(load)
    parameters = model.complete({OBJECT: "donut", **next(iter(get_load(load).presets.values()))})
    motion = model.solve(parameters=parameters)
    vertices, (obstacle,) = motion.vertices(TIMES), get_load(load).obstacles(parameters)
    gaps = obstacle.met(vertices)[0]
    assert gaps.min() > -1e-6
    assert gaps.min() < 1e-3, "it has met it"
    assert vertices[..., 2].min() > -2e-3
    assert motion.status == "ok"


@pytest.mark.parametrize("load", ["wall", "step", "slope"])
def test_what_is_shown_is_the_pose_and_the_deformation(pushed: Predictor, load: str) -> None:
    motion = pushed.under(load).solve(parameters={OBJECT: "pillow"})
    for time in TIMES[::8]:
        pose = motion.pose(time)
        placed = motion.deformed(time) @ pose[:3, :3].T + pose[:3, 3]
        np.testing.assert_allclose(placed, motion.vertices(time), atol=3e-6)


def test_a_batch_has_an_obstacle_for_each_motion(pushed: Predictor) -> None:
    model, distances = pushed.under("wall"), np.array([0.25, 0.4])
    batch = model.solve_batch({OBJECT: "donut", "distance": distances})
    for index, distance in enumerate(distances):
        alone = model.solve(parameters={OBJECT: "donut", "distance": distance})
        np.testing.assert_allclose(batch.vertices(TIMES)[index], alone.vertices(TIMES), atol=1e-6)
        assert batch.status[index] == alone.status


def test_a_body_deep_inside_an_obstacle_is_implausible(pushed: Predictor) -> None:
    """Which the mechanics keeps it out of: coordinates of a free flight, checked as if a wall were in its way."""
    thrown = pushed.under("throw")
    parameters = thrown.complete({OBJECT: "donut", "velocity_x": 1.5, "spin_y": 0.0})
    model = thrown.model_of(parameters)
    motion = thrown.solve(parameters=parameters)
    wall = get_load("wall").obstacles({"distance": 0.25})
    body, passed = motion.body, motion.schema.window.passed(TIMES)
    free, met = (body.sample(motion.coordinates(TIMES), passed, some).lowest for some in ((), wall))
    limits = model.validity.limits
    assert free.min() > limits.floor - limits.depth
    assert met.min() < limits.floor - limits.depth


@pytest.mark.parametrize(
    ("load", "values", "said"),
    [
        ("wall", {"distance": 0.02}, "inside it"),
        ("wall", {"distance": -1.0}, "distance: expected"),
        ("wall", {"distance": float("inf")}, "distance"),
        ("step", {"rise": 2.0}, "not higher than the throw"),
        ("step", {"rise": 0.0}, "rise: expected"),
        ("step", {"distance": 0.01, "rise": 0.19, "height": 0.18}, "inside it"),
        ("slope", {"angle": 90.0}, "angle: expected a slope"),
        ("slope", {"angle": 0.0}, "angle: expected a slope"),
        ("slope", {"height": -0.05}, "height: expected"),
    ],
)
def test_what_cannot_happen_is_refused_in_one_line(
    pushed: Predictor, load: str, values: dict[str, float], said: str
) -> None:
    with pytest.raises(InputError, match=said) as found:
        pushed.under(load).solve(parameters={OBJECT: "donut", **values})
    assert "\n" not in str(found.value)


@pytest.mark.parametrize("load", ["wall", "step", "slope"])
def test_all_draws_of_data_sets_begin_outside(pushed: Predictor, load: str) -> None:
    model = pushed.under(load)
    for parameters in get_scene(f"object-{load}").sample(32, 1):
        get_load(load).situation(model.rest_of(parameters), parameters)


def test_no_face_is_cut_by_the_edge_of_a_step(pushed: Predictor) -> None:
    model = pushed.under("step")
    parameters = model.complete({OBJECT: "donut", **get_load("step").presets["against its edge"]})
    motion, (edge,) = model.solve(parameters=parameters), get_load("step").obstacles(parameters)
    vertices, faces = motion.vertices(np.linspace(0.1, 0.6, 101)), model.rest_of(parameters).faces
    middles = 0.5 * (vertices[:, faces] + vertices[:, np.roll(faces, 1, axis=1)])
    assert edge.met(middles)[0].min() > -2e-3
