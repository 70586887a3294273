"""Simulations of objects that are dropped, thrown and kicked."""

import numpy as np
import pytest
from soft_block import POISSON, YOUNG, grid, outside

from odeform.errors import InputError
from odeform.geometry.solids.tetrahedra import inside_out, outward
from odeform.loads.load import Load
from odeform.loads.obstacle import Obstacle
from odeform.loads.registry import get_load, known_loads, load_of_scene, register_load, split_load
from odeform.loads.situation import Flight, Situation, Twin
from odeform.loads.slope import slope
from odeform.loads.step import step
from odeform.loads.wall import wall
from odeform.schema import Parameter, Window
from odeform.simulation.flex import Contact
from odeform.simulation.inversion import GuardedBody
from odeform.simulation.loaded import released, simulate_situation
from odeform.simulation.objects.body import SoftBody
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.objects.soft_object import SoftMaterial, SoftObject
from odeform.simulation.obstacles import obstacle_xml
from odeform.simulation.scenes.loaded import scene_of, simulate_load
from odeform.simulation.scenes.registry import find_scene, get_scene
from odeform.surroundings import GRAVITY
from odeform.types import Mesh


def soft_block(young: float = YOUNG) -> SoftObject:
    points, elements = grid()
    elements = outward(points, elements)
    faces = outside(elements, points)
    surface = np.unique(faces)
    order = np.concatenate([surface, np.setdiff1d(np.arange(len(points)), surface)])
    number = np.argsort(order)
    material = SoftMaterial(young, POISSON, 400.0, 0.004, 0.5, "")
    return SoftObject(
        "block", points[order], number[elements], number[faces], points[order], material, (1.0, 5.0), 0.05
    )


def test_a_body_falls_and_turns_as_a_rigid_one_before_it_lands() -> None:
    item, spin, velocity = soft_block(), np.array([0.0, 4.0, 0.0]), np.array([0.5, 0.0, 0.2])
    times, vertices = simulate_situation(item, Situation(Flight(0.4, velocity=velocity, spin=spin)), 100.0, 0.1)
    assert vertices[0, :, 2].min() == pytest.approx(0.4, abs=1e-6)
    centres = np.einsum("tni,n->ti", vertices, item.weights)
    fall = centres[0] + np.outer(times, velocity) - np.outer(4.905 * times**2, [0.0, 0.0, 1.0])
    np.testing.assert_allclose(centres, fall, atol=2e-3)
    lengths = np.linalg.norm(vertices[:, 0] - vertices[:, -1], axis=1)
    np.testing.assert_allclose(lengths, lengths[0], rtol=5e-3)


def test_a_body_begins_in_the_pose_that_it_is_given() -> None:
    item = soft_block()
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    points, speeds = released(item, Flight(0.1, turn, np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 2.0])))
    np.testing.assert_allclose(np.ptp(points, axis=0), np.ptp(item.points, axis=0)[[1, 0, 2]], atol=1e-9)
    np.testing.assert_allclose(speeds[:, 0], 1.0 - 2.0 * points[:, 1], atol=1e-9)
    assert released(item, None)[0] is item.settled


def test_tetrahedra_that_an_impact_flattens_do_not_stay_inside_out() -> None:
    item = soft_block(4e3)
    flight = Flight(0.001, velocity=np.array([0.0, 0.0, -4.0]))
    positions, velocities = released(item, flight)
    inverted = {}
    for guarded in (False, True):
        body = SoftBody(item.points, item.elements, item.material, 5e-4)
        body.positions, body.velocities[:] = positions, velocities
        one = GuardedBody(body, item.points, item.elements) if guarded else body
        for _ in range(200):
            one.step()
        inverted[guarded] = int(inside_out(body.positions, item.elements).sum())
    assert inverted[False] > 0, "without the guard they do, or this test shows nothing"
    assert inverted[True] == 0


def test_the_guard_changes_nothing_where_no_tetrahedron_is_flat() -> None:
    item = soft_block()
    positions, velocities = released(item, Flight(0.002, velocity=np.array([0.0, 0.0, -0.3])))
    ends = []
    for guarded in (False, True):
        body = SoftBody(item.points, item.elements, item.material, 5e-4)
        body.positions, body.velocities[:] = positions, velocities
        one = GuardedBody(body, item.points, item.elements) if guarded else body
        for _ in range(40):
            one.step()
        ends.append(body.positions)
    np.testing.assert_array_equal(*ends)


def test_a_kick_gives_the_body_its_impulse() -> None:
    item, load = soft_block(), get_load("kick")
    parameters = {
        "contact_x": -0.06,
        "contact_y": 0.0,
        "contact_z": 0.03,
        "force_x": 20.0,
        "force_y": 0.0,
        "force_z": 0.0,
    }
    sequence = simulate_load(load, item, parameters, rate=500.0, until=0.026)
    speed = np.diff(np.einsum("tni,n->ti", sequence.vertices.astype(float), sequence.weights), axis=0)[-1, 0] * 500.0
    given = 0.5 * 0.02 * 20.0 / item.mass
    assert 0.5 * given < speed < given, "friction takes some of it"


@pytest.mark.parametrize("name", ["drop", "throw", "kick", "wall", "step", "slope", "hold"])
def test_each_load_is_a_scene_of_all_objects(name: str) -> None:
    scene = get_scene(f"object-{name}")
    assert find_scene(scene.schema.scene) is scene
    found = load_of_scene(scene.schema.scene)
    assert found is not None
    assert found.name == name
    drawn = scene.sample(3, 0, ["donut"])
    assert scene.sample(2, 0, ["donut"]) == drawn[:2], "a longer list starts with the shorter one"
    rest = get_object("donut").rest_mesh()
    for row in drawn:
        assert set(row) == set(scene.schema.names)
        found.situation(rest, row)
        assert all(np.isfinite(arrow.vector).all() for arrow in scene.glyphs(row, rest.points))
    for values in found.presets.values():
        found.situation(rest, scene.schema.complete(values))


@pytest.mark.parametrize(
    ("name", "values", "says"),
    [
        ("drop", {"height": -0.01}, "above the floor"),
        ("drop", {"height": 1e6}, "above the floor"),
        ("throw", {"spin_x": 1000.0}, "rad/s"),
        ("throw", {"velocity_x": 50.0}, "m/s"),
        ("kick", {"contact_x": 5.0}, "mm off it"),
        ("kick", {"force_x": 0.0, "force_y": 0.0, "force_z": 1.0}, "pulls"),
    ],
)
def test_what_cannot_happen_is_refused_in_words(name: str, values: dict[str, float], says: str) -> None:
    scene, rest = get_scene(f"object-{name}"), get_object("donut").rest_mesh()
    top = rest.points[rest.points[:, 2].argmax()]
    at = dict(zip(("contact_x", "contact_y", "contact_z"), map(float, top), strict=True)) if name == "kick" else {}
    with pytest.raises(InputError, match=says):
        get_load(name).situation(rest, scene.schema.complete({"object": "donut", **at, **values}))


def test_a_load_of_ones_own_is_one_value() -> None:
    height = Parameter("height", "m", 0.1, 0.2, 0.15)

    def situation(rest: Mesh, parameters: dict[str, float]) -> Situation:
        return Situation(Flight(parameters["height"]))

    load = Load("let-go", "Let it go", (height,), Window(0.0, 0.2, 50.0), 0.5, situation)
    register_load(load)
    assert get_load("let-go") is load
    assert "let-go" in known_loads()
    assert scene_of(load).schema.scene == "object-let-go"
    assert split_load("contact-force:let-go") == ("contact-force", "let-go")
    with pytest.raises(InputError, match="free"):
        register_load(Load("drop", "", (height,), load.window, 0.5, situation))


def test_names_without_a_load_stay_as_they_are() -> None:
    assert split_load("kick") == ("kick", "push")
    assert split_load("C:/models/kick.safetensors") == ("C:/models/kick.safetensors", "push")
    assert split_load("contact-force:drop") == ("contact-force", "drop")


@pytest.mark.parametrize(
    ("obstacle", "speed"),
    [(wall(0.1), 1.5), (step(0.1, 0.1), 1.5), (slope(0.12, 0.6), 0.0)],
    ids=["wall", "step", "slope"],
)
def test_a_simulated_body_does_not_pass_through_an_obstacle(obstacle: Obstacle, speed: float) -> None:
    item, flight = soft_block(), Flight(0.13, velocity=np.array([speed, 0.0, -0.5]))
    ends = {}
    for name, obstacles in (("met", (obstacle,)), ("free", ())):
        _, vertices = simulate_situation(item, Situation(flight, obstacles=obstacles), 200.0, 0.06)
        ends[name] = -float(obstacle.met(vertices)[0].min())
    assert ends["met"] < 3e-3, "as deep as it sinks into the floor"
    assert ends["free"] > 0.01, "without the obstacle it does, or this test shows nothing"


def test_obstacles_that_the_simulator_does_not_have_are_refused() -> None:
    ledge = Obstacle(np.zeros(3), np.full(3, -np.inf), np.array([0.0, np.inf, 0.0]), (np.zeros(3), np.ones(3)))
    with pytest.raises(ValueError, match="half space"):
        obstacle_xml([ledge], Contact(0.5, 0.002))


def test_a_simulated_body_hangs_from_what_holds_it() -> None:
    """A coarse block: springs stand for its weight, and its free end falls."""
    item, load = soft_block(), get_load("hold")
    parameters = get_scene("object-hold").schema.complete({"object": "donut", "held_up": 0.0, "height": 0.3})
    sequence = simulate_load(load, item, parameters, rate=100.0, until=0.2)
    clamp = load.situation(item.rest_mesh(), parameters).clamp
    assert clamp is not None
    moved = sequence.vertices.astype(float) - sequence.vertices[0]
    first, last = moved[:, clamp.vertex], moved[:, int(np.linalg.norm(moved[-1], axis=1).argmax())]
    assert np.abs(first).max() < 6.0 * clamp.sink, "the patch is held"
    assert last[:, 2].min() < -3.0 * np.abs(first).max(), "the other end is not"
    weight = clamp.stiffness(item.settled[: item.surface_count], item.weights, item.mass).sum() * clamp.sink
    assert weight == pytest.approx(item.mass * GRAVITY)


def test_what_a_thrown_block_loses_one_like_it_gains() -> None:
    """High above the floor, which friction would act on: both begin in the air, the one at rest."""
    item, high = soft_block(), np.array([0.0, 0.0, 1.0])
    flight = Flight(1.0, velocity=np.array([2.0, 0.0, 0.0]))
    twin = Twin(np.array([0.14, 0.01, 0.0]) + high)
    times, frames = simulate_situation(item, Situation(flight, twin=twin), 200.0, 0.06)
    assert frames.shape[1] == 2 * item.surface_count
    speeds = np.diff(frames.reshape(len(times), 2, -1, 3), axis=0) * 200.0
    along = np.einsum("tbnk,n->tbk", speeds, item.weights)[..., 0]
    assert along[-1, 0] < 1.5, "it is held up"
    assert along[-1, 1] > 0.5, "and the other one is pushed away"
    np.testing.assert_allclose(along.sum(axis=1), 2.0, atol=0.05)
