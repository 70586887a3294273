"""Reduced mechanics of bodies that meet a wall, a step, a slope."""

from dataclasses import replace

import numpy as np
import pytest
from same_steps import assert_same_steps
from scipy.spatial.transform import Rotation
from soft_block import SIZE, Block

from odeform.compiling import compiles
from odeform.loads.obstacle import Obstacle, half_space
from odeform.loads.situation import Flight, Situation
from odeform.loads.slope import slope
from odeform.loads.step import step
from odeform.loads.wall import wall
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.flat import body_motion, parts_of
from odeform.mechanics.pushed import PushedBody
from odeform.mechanics.step import Mechanics, Projectile
from odeform.models.modal.loaded import LoadedBody
from odeform.solver.integrate import SolverSettings, integrate
from odeform.surroundings import GRAVITY
from odeform.types import Floats

FINE = SolverSettings("limex", tolerance=1e-5, dtype="float64")
TILTED = Rotation.from_rotvec([0.7, -0.4, 0.2]).as_matrix()


def flier(block: Block, parameters: ContactParameters | None = None) -> LoadedBody:
    anchor = np.array([0.0, 0.0, block.body.solid.height])
    known = parameters or ContactParameters()
    mechanics = Mechanics(block.body, known, Projectile(0.02, 0.02), lands=True, free=np.zeros(12))
    return LoadedBody(mechanics, 8, anchor, np.eye(3))


def moved(body: LoadedBody, situation: Situation, times: Floats) -> tuple[Floats, Floats]:
    """Mass centres (T, 3) m and velocities (T, V)."""
    begun = body.begin([situation])
    states = integrate(PushedBody(body.mechanics, begun.push, 0.0), begun.start[0], FINE, float(times[-1])).sample(
        times
    )
    return body_motion(states)[0] + body.anchor, states[:, parts_of(states)[-1]]


def test_distances_and_normals_of_a_box() -> None:
    box = step(0.5, 0.1)  # from x = 0.5 to 1 m, and up to z = 0.1 m
    points = np.array([[0.4, 0.0, 0.05], [0.7, 0.0, 0.3], [0.47, 0.0, 0.14], [0.503, 0.0, 0.05], [0.7, 0.0, 0.09]])
    gap, normal = box.met(points)
    np.testing.assert_allclose(gap, [0.1, 0.2, 0.05, -0.003, -0.01], atol=1e-12)
    sides = [[-1, 0, 0], [0, 0, 1], [-0.6, 0, 0.8], [-1, 0, 0], [0, 0, 1]]
    np.testing.assert_allclose(normal, sides, atol=1e-12)
    kept = points.copy()
    box.keep_out(kept)
    np.testing.assert_allclose(kept[3:], [[0.5, 0.0, 0.05], [0.7, 0.0, 0.1]], atol=1e-12)
    np.testing.assert_array_equal(kept[:3], points[:3])


def test_what_is_deep_in_a_step_does_not_leave_it_through_the_floor() -> None:
    deep = np.array([[0.75, 0.0, 0.01]])  # 0.19 m below the top, 0.25 m from the sides
    step(0.5, 0.2).keep_out(deep)
    np.testing.assert_allclose(deep, [[0.75, 0.0, 0.2]], atol=1e-12)


@pytest.mark.parametrize("obstacle", [wall(0.3), step(0.3, 0.1), slope(0.3, 0.5)], ids=["wall", "step", "slope"])
def test_normals_are_the_slopes_of_distances(obstacle: Obstacle) -> None:
    points, small = np.random.default_rng(0).uniform(-0.6, 0.6, (200, 3)), 1e-6
    gap, normal = obstacle.met(points)
    assert (gap > 0.0).any()
    assert (gap < 0.0).any()
    slopes = [(obstacle.met(points + small * axis)[0] - gap) / small for axis in np.eye(3)]
    np.testing.assert_allclose(normal, np.stack(slopes, axis=1), atol=1e-4)


@pytest.mark.parametrize("obstacle", [wall(0.3), step(0.3, 0.1), slope(0.3, 0.5)], ids=["wall", "step", "slope"])
def test_what_is_drawn_of_an_obstacle_is_its_surface(obstacle: Obstacle) -> None:
    mesh = obstacle.mesh
    corners = mesh.points[mesh.faces].astype(float)
    gap, normal = obstacle.met(corners.mean(axis=1))
    np.testing.assert_array_less(gap, 1e-6)
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    on = np.abs(gap) < 1e-6
    assert (np.einsum("ni,ni->n", outward, normal)[on] > 0.0).all()
    assert on.any()


def test_a_wall_sends_a_body_back(block: Block) -> None:
    times, middle = np.linspace(0.0, 0.1, 51), 0.5 * SIZE[0]
    for obstacles in ((wall(middle + 0.05),), ()):
        thrown = Situation(Flight(0.5, velocity=np.array([2.0, 0.0, 0.0])), obstacles=obstacles)
        centres, velocity = moved(flier(block), thrown, times)
        if obstacles:
            assert velocity[-1, 0] < -0.2, "its momentum is reversed"
            assert centres[:, 0].max() + middle < middle + 0.05 + 0.5 * SIZE[0]
        else:
            np.testing.assert_allclose(velocity[:, 0], 2.0, atol=1e-9, err_msg="without the wall it flies on")


def test_no_energy_is_gained_at_a_step_and_it_comes_to_rest(block: Block) -> None:
    body, times = flier(block), np.linspace(0.0, 1.5, 601)
    thrown = Situation(Flight(0.15, TILTED, np.array([0.8, 0.0, 0.0])), obstacles=(step(0.15, 0.08),))
    begun = body.begin([thrown])
    states = integrate(PushedBody(body.mechanics, begun.push, 0.0), begun.start[0], FINE, 1.5).sample(times)
    velocity = states[:, parts_of(states)[-1]]
    inertia, mass = block.body.solid.inertia, block.body.solid.mass
    shift, rotation, modes = body_motion(states)
    local = np.einsum("tji,tj->ti", rotation, velocity[:, 3:6])
    kinetic = mass * (velocity[:, :3] ** 2).sum(axis=1) + np.einsum("ti,ij,tj->t", local, inertia, local)
    stiff = body.mechanics.parameters.stiffness * block.body.eigenvalues[:8]
    energy = 0.5 * (kinetic + (velocity[:, 6:14] ** 2).sum(axis=1) + modes**2 @ stiff) + mass * GRAVITY * shift[:, 2]
    assert energy.max() < energy[0] + 1e-6 * abs(energy[0])
    assert np.abs(velocity[-1, :6]).max() < 0.02


@pytest.mark.parametrize("steeper", [0.9, 1.1])
def test_a_body_slides_where_the_slope_is_steeper_than_friction(block: Block, steeper: float) -> None:
    """As a block on a plane does: from tan(angle) = friction on, with g (sin - friction cos)."""
    body = flier(block)
    friction = body.mechanics.parameters.floor_friction
    angle = np.arctan(steeper * friction)
    plane = half_space(np.zeros(3), np.array([np.sin(angle), 0.0, np.cos(angle)]), (-1.0, 1.0), (-1.0, 1.0))
    lying, up = Rotation.from_rotvec([0.0, angle, 0.0]).as_matrix(), 1.0
    plane = replace(plane, place=np.array([0.0, 0.0, up]))
    corners = (block.points - [0.0, 0.0, block.body.solid.height]) @ lying.T
    centre = up - (corners @ plane.turn[:, 2]).min() / plane.turn[2, 2]
    flight = Flight(centre + corners[:, 2].min(), lying)
    times = np.linspace(0.0, 0.4, 41)
    _, velocity = moved(body, Situation(flight, obstacles=(plane,)), times)
    along = velocity[:, :3] @ plane.turn[:, 0]
    rate = (along[-1] - along[20]) / (times[-1] - times[20])
    if steeper < 1.0:
        assert along[-1] < 0.02, "it creeps, as on the floor under a force: friction grows with the speed of sliding"
        assert abs(rate) < 0.02 * GRAVITY
    else:
        assert rate == pytest.approx(GRAVITY * (np.sin(angle) - friction * np.cos(angle)), rel=0.1)


@pytest.mark.skipif(not compiles(), reason="needs Numba")
@pytest.mark.parametrize(
    "obstacles",
    [((wall(0.1),), (wall(0.105),)), ((step(0.1, 0.05),), (step(0.09, 0.06),)), ((slope(0.1, 0.6), wall(0.1)),) * 2],
    ids=["wall", "step", "slope and wall"],
)
def test_compiled_steps_are_those_of_numpy(block: Block, obstacles: tuple[tuple[Obstacle, ...], ...]) -> None:
    body = flier(block)
    speed, spin = np.array([2.0, 0.0, -1.5]), np.array([5.0, 12.0, 3.0])
    flights = [Flight(height, TILTED, speed, spin) for height in (0.03, 0.04)]
    begun = body.begin([Situation(f, obstacles=some) for f, some in zip(flights, obstacles, strict=True)])
    free = replace(begun.push, obstacles=None)
    _, met = assert_same_steps(body.mechanics, begun.push, begun.start, 60, free)
    assert met > 1e-3, "they have met an obstacle"


def test_a_side_that_an_edge_cuts_goes_off_it_and_others_stay() -> None:
    box = step(0.5, 0.2)
    # over the edge, with ends on top and in front; in front alone; on top alone; along the edge
    points = np.array([[[0.56, 0.0, 0.2], [0.5, 0.0, 0.16], [0.4, 0.0, 0.1], [0.7, 0.1, 0.2], [0.5, 0.2, 0.2]]])
    sides = np.array([[0, 1], [1, 2], [0, 3], [3, 4]])
    moved = points.copy()
    box.keep_sides_out(moved, sides)
    places = moved[:, sides[:, :1]] + np.linspace(0.0, 1.0, 101)[:, None] * (
        moved[:, sides[:, 1:]] - moved[:, sides[:, :1]]
    )
    assert box.met(places)[0].min() > -2e-3
    assert box.met(points[:, sides].mean(axis=2))[0].min() < -0.015, "it was cut"
    np.testing.assert_array_equal(moved[:, 2:], points[:, 2:])
    assert np.abs(moved - points).max() < 0.04


def test_no_side_is_cut_by_what_has_no_edge() -> None:
    wall = half_space(np.array([0.5, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0]), (-1.0, 1.0), (0.0, 1.0))
    points = np.random.default_rng(0).normal(scale=0.5, size=(4, 20, 3))
    wall.keep_out(points)
    moved = points.copy()
    wall.keep_sides_out(moved, np.stack([np.arange(19), np.arange(1, 20)], axis=1))
    np.testing.assert_array_equal(moved, points)
